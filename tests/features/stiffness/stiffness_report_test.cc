// Page, terminal text, summary and tables of a stiffness, literally, and that each number counts.
#include "features/stiffness/stiffness_report.h"

#include <functional>
#include <set>

#include "report/terminal_text.h"
#include "tests/support/golden_file.h"
#include "tests/support/reports.h"

namespace mbv {
namespace {

using OrderedJson = nlohmann::ordered_json;

std::string VerboseTable(const StiffnessReport& report) {
  return ToTable(report, {.color = false, .verbose = true});
}

TEST(StiffnessReport, SummaryIsAsWritten) {
  const OrderedJson json = OrderedJson::parse(ToJson(test::StiffArm()));
  ExpectGolden("stiffness_summary.json", Rounded(json).dump(2) + "\n");
}

TEST(StiffnessReport, TerminalTextIsAsWritten) {
  ExpectGolden("stiffness_table.txt", VerboseTable(test::StiffArm()));
}

TEST(StiffnessReport, PageIsAsWritten) {
  ExpectGolden("stiffness_page.html", WithoutAssets(ToHtml(test::StiffArm())));
}

TEST(StiffnessReport, TablesForProgramsAreAsWritten) {
  const StiffnessReport report = test::StiffArm();
  ExpectGolden("stiffness.csv", StiffnessCsv(report));
  ExpectGolden("stiffness_loads.csv", LoadsCsv(report));
  const std::string shares = ContributionsCsv(report);
  EXPECT_TRUE(
      shares.starts_with("witness,element,weakest_translation,weakest_rotation,rx,ry,rz,x,y,z\n"
                         "analytic,link <1>,0.75"))
      << shares;
  EXPECT_EQ(std::count(shares.begin(), shares.end(), '\n'), 1 + 2 + 2 + 2) << shares;
}

// What a spreadsheet would compute is a text in every table.
TEST(StiffnessReport, TablesHoldNoFormulas) {
  StiffnessReport report = test::StiffArm();
  for (StiffnessWitness& witness : report.witnesses) witness.name = "=cmd|'/C calc'!A0,\x1b[2J";
  for (const std::string& table :
       {StiffnessCsv(report), LoadsCsv(report), ContributionsCsv(report)}) {
    EXPECT_EQ(table.find("\n=cmd"), std::string::npos) << table;
    EXPECT_EQ(table.find(",=cmd"), std::string::npos) << table;
    EXPECT_EQ(table.find('\x1b'), std::string::npos) << table;
  }
  const std::string text = StiffnessCsv(report);
  EXPECT_NE(text.find("\n\"'=cmd|'/C calc'!A0,\\x1b[2J\",K,"), std::string::npos) << text;
}

TEST(StiffnessReport, TheShortLineNamesVerdictValueAndLimit) {
  EXPECT_EQ(VerdictLine(ViewOf(test::StiffArm()), {}),
            "arm / held: DISAGREE  simulated vs analytic 2.0e-02 (limit 1.0e-04)  6 of 24 "
            "checks exceed their limits\n");
  const RunCounts counts = CountOf(ViewOf(test::StiffArm()));
  EXPECT_EQ(CountLine(counts), "1 scenario: 1 ran, 1 compared, 0 verified\n");
}

// A witness that broke down: where, by how much, and that nothing is agreed on.
TEST(StiffnessReport, ReportsWhatBrokeDown) {
  StiffnessReport report = test::StiffArm();
  StiffnessWitness& reference = report.witnesses[1];
  reference.result = StiffnessResult{};
  reference.displacements.clear();
  reference.result.summary = {.stop = Stop::kSingular,
                              .message = "the frame is loose",
                              .where = "beam 3",
                              .amount = 0.5,
                              .unit = "N/m"};
  report.comparison = test::CompareAll(report.witnesses);
  report.exit_code = 3;
  const auto json = OrderedJson::parse(ToJson(report));
  const auto& witness = json["witnesses"][1];
  EXPECT_EQ(json["verdict"], "not_run");
  EXPECT_EQ(json["counts"]["witnesses_ran"], 2);
  EXPECT_EQ(json["counts"]["pairs_compared"], 1);
  EXPECT_EQ(witness["ran"], false);
  EXPECT_EQ(witness["stop"], "singular pose");
  EXPECT_EQ(witness["message"], "the frame is loose");
  EXPECT_EQ(witness["where"], "beam 3");
  EXPECT_EQ(witness["amount"], 0.5);
  EXPECT_EQ(witness["unit"], "N/m");
  EXPECT_EQ(witness["rank"], -1);
  EXPECT_TRUE(witness["K"][0][0].is_null());
  EXPECT_FALSE(witness.contains("time_s"));
  const std::string page = ToHtml(report);
  EXPECT_NE(page.find("<li><b>reference</b>: singular pose. the frame is loose</li>"),
            std::string::npos);
  EXPECT_NE(page.find("verdict not_run\"><span aria-hidden=\"true\">?</span> Not run<"),
            std::string::npos);
  const std::string text = VerboseTable(report);
  EXPECT_TRUE(text.starts_with("arm / held: NOT RUN\n")) << text;
  EXPECT_EQ(text.find("analytic  reference  simulated"), std::string::npos) << text;
}

struct PerturbedField {
  const char* what;
  std::function<void(StiffnessReport*)> apply;
  std::set<std::string> unseen = {};  // where it is not reported: it has no place there
};

// The truth, perturbed in one place: page, terminal text and summary differ.
TEST(StiffnessReport, EveryFieldIsReported) {
  const std::vector<PerturbedField> perturbations = {
      {"scenario", [](auto* r) { r->scenario = "other"; }},
      {"scenario file", [](auto* r) { r->scenario_file = "other"; }, {"text"}},
      {"mechanism", [](auto* r) { r->mechanism = "other"; }},
      {"model file", [](auto* r) { r->model_file = "other"; }, {"text"}},
      {"description", [](auto* r) { r->description = "other"; }},
      {"output", [](auto* r) { r->output = "other"; }},
      {"pose", [](auto* r) { r->pose[1].value += 0.01; }},
      {"pose's note", [](auto* r) { r->pose_note = "other"; }, {"json"}},
      {"origin", [](auto* r) { r->p_WO[1] += 0.01; }, {"json"}},
      {"model", [](auto* r) { r->model = "other"; }},
      {"K", [](auto* r) { r->witnesses[0].result.K(1, 2) += 0.5; }},
      {"C", [](auto* r) { r->witnesses[0].result.C(2, 2) *= 1.5; }},
      {"rank", [](auto* r) { r->witnesses[0].result.rank = 5; }},
      {"a share", [](auto* r) { r->witnesses[0].result.shares[0].C *= 1.1; }},
      {"an element", [](auto* r) { r->witnesses[0].result.shares[0].element = "other"; }},
      {"printed model", [](auto* r) { r->printed_pairs[0].metrics.begin()->second.value = 0.25; }},
      {"index", [](auto* r) { r->indices[0].values[1] = 9.5; }},
      {"index' unit", [](auto* r) { r->indices[0].unit = "other"; }},
      {"index' meaning", [](auto* r) { r->indices[0].meaning = "other"; }},
      {"what the loads are", [](auto* r) { r->loads_text = "other"; }},
      {"displacement", [](auto* r) { r->witnesses[2].displacements[1][4] *= 2; }},
      {"verdict", [](auto* r) { r->comparison.verdict = Verdict::kAgree; }},
      {"reason", [](auto* r) { r->comparison.reason = "other"; }},
      {"attribution", [](auto* r) { r->comparison.attribution.text = "other"; }},
      {"odd one out", [](auto* r) { r->comparison.attribution.odd_one_out = ""; }, {"text"}},
      {"a check's value", [](auto* r) { r->comparison.checks[3].value = 0.875; }},
      {"a check's limit", [](auto* r) { r->comparison.checks[3].limit = 0.875; }},
      {"that a check passes", [](auto* r) { r->comparison.checks[3].pass ^= true; }},
      {"where a check is worst", [](auto* r) { r->comparison.checks[3].channel = "other"; }},
      {"a gap",
       [](auto* r) {
         r->comparison.not_compared.push_back({"this", "that"});
       }},
      {"exit code", [](auto* r) { r->exit_code = 0; }, {"page", "text"}},
      {"finding", [](auto* r) { r->findings.Add(test::Warning("other")); }},
      {"time", [](auto* r) { r->timing.reference_s = 0.125; }},
      {"total time", [](auto* r) { r->timing.total_s = 0.875; }, {"page"}},
      {"version", [](auto* r) { r->versions[1].second = "3.0"; }, {"text"}},
      {"parameter", [](auto* r) { r->parameters[0].value = 1e11; }, {"json", "text"}},
      {"command", [](auto* r) { r->command = "other"; }, {"json", "text"}}};
  const StiffnessReport right = test::StiffArm();
  for (const PerturbedField& perturbed_entry : perturbations) {
    StiffnessReport perturbed = right;
    perturbed_entry.apply(&perturbed);
    EXPECT_EQ(ToJson(perturbed) == ToJson(right), perturbed_entry.unseen.contains("json"))
        << perturbed_entry.what;
    EXPECT_EQ(VerboseTable(perturbed) == VerboseTable(right),
              perturbed_entry.unseen.contains("text"))
        << perturbed_entry.what;
    EXPECT_EQ(ToHtml(perturbed) == ToHtml(right), perturbed_entry.unseen.contains("page"))
        << perturbed_entry.what;
  }
}

TEST(StiffnessReport, ColourAddsEscapesAndNothingElse) {
  std::string colored = ToTable(test::StiffArm(), {.color = true, .verbose = true});
  EXPECT_NE(colored.find("\x1b[1;31mDISAGREE\x1b[0m"), std::string::npos);
  EXPECT_NE(colored.find("\x1b[1;32mok\x1b[0m"), std::string::npos);
  for (size_t at; (at = colored.find('\x1b')) != std::string::npos;) {
    colored.erase(at, colored.find('m', at) - at + 1);
  }
  // A word's own blanks end no plain line.
  for (size_t at; (at = colored.find(" \n")) != std::string::npos;) colored.erase(at, 1);
  EXPECT_EQ(colored, VerboseTable(test::StiffArm()));
}

TEST(StiffnessReport, APrintedModelThatCannotBeComparedSaysWhy) {
  StiffnessReport report = test::StiffArm();
  report.printed_pairs[0].compared = false;
  report.printed_pairs[0].reason = "it is singular";
  EXPECT_NE(VerboseTable(report).find("  the paper's own model: it is singular\n"),
            std::string::npos);
}

TEST(StiffnessReport, WhereNothingRanThereAreNoMatrices) {
  StiffnessReport report = test::StiffArm();
  report.printed_pairs.clear();
  report.printed.clear();
  for (StiffnessWitness& witness : report.witnesses) {
    witness.result = StiffnessResult{};
    witness.displacements.clear();
  }
  report.comparison = test::CompareAll(report.witnesses);
  EXPECT_EQ(report.Shown(), nullptr);
  EXPECT_EQ(report.WithShares(), nullptr);
  EXPECT_EQ(VerboseTable(report).find("K ("), std::string::npos);
  const std::string page = ToHtml(report);
  for (const char* section : {"id=\"stiffness\"", "id=\"elements\"", "<dt>Rank</dt>"}) {
    EXPECT_EQ(page.find(section), std::string::npos) << section;
  }
  EXPECT_FALSE(OrderedJson::parse(ToJson(report)).contains("weakest"));
  EXPECT_EQ(StiffnessCsv(report), "witness,matrix,row,column,unit,value\n");
  EXPECT_EQ(CountLine(CountOf(ViewOf(report))), "1 scenario: 0 ran, 0 compared, 0 verified\n");
}

}  // namespace
}  // namespace mbv
