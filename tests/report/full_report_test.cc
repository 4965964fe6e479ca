// A motion's page, terminal text and summary with everything that they can show, literally, and
// that each number counts.
#include <algorithm>
#include <functional>
#include <set>

#include "report/html_report.h"
#include "report/report.h"
#include "tests/support/golden_file.h"
#include "tests/support/reports.h"

namespace mbv {
namespace {

using FullJson = nlohmann::ordered_json;

std::string PageOf(const test::FullPage& full) { return WithoutAssets(ToHtml(full.input())); }
std::string TextOf(const Report& report) {
  return ToTable(report, {.color = false, .verbose = true});
}

TEST(FullReport, PageIsAsWritten) { ExpectGolden("page.html", PageOf(test::FullPage())); }

TEST(FullReport, TerminalTextIsAsWritten) {
  ExpectGolden("table_full.txt", TextOf(test::FullReport()));
}

TEST(FullReport, SummaryIsAsWritten) {
  const FullJson json = FullJson::parse(ToJson(test::FullReport()));
  ExpectGolden("summary_full.json", Rounded(json).dump(2) + "\n");
}

TEST(FullReport, TheShortLineReportsCaveats) {
  const Report report = test::FullReport();
  EXPECT_EQ(VerdictLine(ViewOf(report), {}),
            "two_sliders / full: DISAGREE  simulated vs analytic 9.3e-03 (limit 1.0e-06)  the "
            "masses differ; caveat: only 3 samples were compared; caveat: forces < 1 N "
            "are all there is.\n");
}

struct FullPerturbation {
  const char* what;
  std::function<void(test::FullPage*)> apply;
  std::set<std::string> unseen = {};  // where it is not reported: it has no place there
};

PairComparison& PairOf(test::FullPage* f, const char* name) {
  auto& pairs = f->report.comparison.pairs;
  return *std::find_if(pairs.begin(), pairs.end(), [&](const auto& p) { return p.name() == name; });
}
CheckResult& LastCheck(test::FullPage* f, size_t from_end) {
  auto& checks = f->report.comparison.checks;
  return checks[checks.size() - 1 - from_end];
}
EnergyAudit& SimulatedEnergy(test::FullPage* f) {
  for (WitnessMetrics& witness : f->report.comparison.witnesses) {
    if (witness.witness == "simulated") return *witness.energy;
  }
  return *f->report.comparison.witnesses.back().energy;
}

// The truth, perturbed in one place: page, terminal text and summary differ.
TEST(FullReport, EveryFieldIsReported) {
  using F = test::FullPage;
  const std::vector<FullPerturbation> perturbations = {
      {"description", [](F* f) { f->report.description = "other"; }},
      {"simulation", [](F* f) { f->report.simulation = "other"; }, {"json"}},
      {"mode", [](F* f) { f->report.mode = "inverse"; }},
      {"engine", [](F* f) { f->report.engine = "stock"; }, {"page", "text"}},
      {"step", [](F* f) { f->report.step_s = 0.5; }, {"page", "text"}},
      {"duration", [](F* f) { f->report.duration_s = 0.5; }, {"page", "text"}},
      {"sample distance", [](F* f) { f->report.sample_s = 0.5; }, {"page", "text"}},
      {"start-up window", [](F* f) { f->report.start_window_s = 0.5; }},
      {"driven by", [](F* f) { f->report.driven_by = "other"; }, {"page", "text"}},
      {"drives not unique", [](F* f) { f->report.drives_not_unique = {}; }, {"page", "text"}},
      {"not unique for MuJoCo",
       [](F* f) { f->report.simulated_not_unique = {}; },
       {"page", "text"}},
      {"reaction not unique", [](F* f) { f->report.reactions_not_unique = {}; }, {"text"}},
      {"picture", [](F* f) { f->report.pictures = {}; }, {"page", "text"}},
      {"caveat", [](F* f) { f->report.comparison.caveats[1].text = "other"; }},
      {"driving", [](F* f) { f->report.comparison.driving = "other"; }},
      {"a check that follows", [](F* f) { LastCheck(f, 0).follows = true; }},
      {"a check that is insensitive", [](F* f) { LastCheck(f, 2).insensitive = "other"; }, {"page"}},
      {"a check that is not insensitive", [](F* f) { LastCheck(f, 2).insensitive = ""; }},
      {"a check with a floor", [](F* f) { LastCheck(f, 1).floored = false; }},
      {"a stated limit", [](F* f) { LastCheck(f, 3).stated_limit = 0.5; }, {"page"}},
      {"where a limit is from", [](F* f) { LastCheck(f, 3).limit_by = "other"; }, {"page"}},
      {"when a check is worst", [](F* f) { LastCheck(f, 3).time_s = 0.5; }},
      {"a check's channel", [](F* f) { LastCheck(f, 3).channel = "other"; }},
      {"a drive's force", [](F* f) { PairOf(f, "simulated_vs_analytic").drives[1].rms_truth = 5; }},
      {"a drive's NRMSE", [](F* f) { PairOf(f, "simulated_vs_analytic").drives[1].nrmse = 5; }},
      {"a drive's error", [](F* f) { PairOf(f, "simulated_vs_analytic").drives[1].max_error = 5; }},
      {"a drive's time", [](F* f) { PairOf(f, "simulated_vs_analytic").drives[1].time_s = 5; }},
      {"a drive's digits", [](F* f) { PairOf(f, "simulated_vs_analytic").drives[1].digits = 5; }},
      {"a drive's floor",
       [](F* f) { PairOf(f, "simulated_vs_analytic").drives[1].floored = true; }},
      {"digits of all", [](F* f) { PairOf(f, "simulated_vs_analytic").digits = 5; }, {"text"}},
      {"samples", [](F* f) { PairOf(f, "simulated_vs_analytic").samples = 5; }, {"page", "text"}},
      {"a metric",
       [](F* f) { PairOf(f, "simulated_vs_analytic").metrics[Metric::kForceMax].value = 5; },
       {"text"}},
      {"table's name", [](F* f) { f->report.comparison.table->name = "other"; }},
      {"table's grid", [](F* f) { f->report.comparison.table->grid = "other"; }},
      {"table's note", [](F* f) { f->report.comparison.table->notes = {"other"}; }},
      {"table's coverage", [](F* f) { f->report.comparison.table->coverage = 5; }},
      {"table's diagnosis", [](F* f) { f->report.comparison.table->diagnoses = {}; }, {"text"}},
      {"table too coarse", [](F* f) { f->report.comparison.table->too_coarse = ""; }, {"text"}},
      {"table judged", [](F* f) { f->report.comparison.table->judged = false; }, {"json"}},
      {"column's heading",
       [](F* f) { f->report.comparison.table->columns[0].heading = "other"; },
       {"text"}},
      {"column's factor",
       [](F* f) { f->report.comparison.table->columns[0].factor = 5; },
       {"page", "text"}},
      {"column's noise", [](F* f) { f->report.comparison.table->uncertainty[0].noise = 5; }},
      {"column's stamps", [](F* f) { f->report.comparison.table->uncertainty[0].stamps = 5; }},
      {"column's RMS", [](F* f) { PairOf(f, "simulated_vs_reference").columns[1].rms = 5; }},
      {"column's error",
       [](F* f) { PairOf(f, "simulated_vs_reference").columns[1].error_rms = 5; }},
      {"column's largest error",
       [](F* f) { PairOf(f, "simulated_vs_reference").columns[1].error_max = 5; }},
      {"column's tube", [](F* f) { PairOf(f, "simulated_vs_reference").columns[1].tube_max = 5; }},
      {"column's uncertainty",
       [](F* f) { PairOf(f, "simulated_vs_reference").columns[1].standard = 5; }},
      {"engine's error", [](F* f) { f->report.engine_comparison->engines[1].force_nrmse = 5; }},
      {"engine's later error",
       [](F* f) { f->report.engine_comparison->engines[1].force_nrmse_later = 5; }},
      {"engine's largest error",
       [](F* f) { f->report.engine_comparison->engines[1].force_max_rel = 5; },
       {"text"}},
      {"engine's gap", [](F* f) { f->report.engine_comparison->engines[1].closure_max_m = 5; }},
      {"engine's failure", [](F* f) { f->report.engine_comparison->engines[0].failure = "other"; }},
      {"when it is later", [](F* f) { f->report.engine_comparison->later_s = 5; }},
      {"energy", [](F* f) { SimulatedEnergy(f).parts[1].end_J = 5; }},
      {"work", [](F* f) { SimulatedEnergy(f).parts[2].end_J = 5; }},
      {"drift", [](F* f) { SimulatedEnergy(f).drift_J = 5; }, {"text"}},
      {"drift at the end", [](F* f) { SimulatedEnergy(f).end_drift_J = 5; }, {"text"}},
      {"relative drift", [](F* f) { SimulatedEnergy(f).drift.value = 5; }, {"text"}},
      {"whose drift", [](F* f) { SimulatedEnergy(f).culprit = "other"; }, {"page", "text"}},
      {"what of the drift", [](F* f) { SimulatedEnergy(f).text = "other"; }},
      {"how work is found", [](F* f) { SimulatedEnergy(f).integrated = true; }, {"text"}},
      {"a force over time",
       [](F* f) { f->report.witnesses[2].trace.values.col(3) *= 2; },
       {"text"}},
      {"a signal's sheet", [](F* f) { f->report.sheets[0].positive = "other"; }},
      {"a frame", [](F* f) { f->report.sheets[0].frame = "other"; }},
      {"what a force acts on", [](F* f) { f->report.sheets[0].acts_on = "other"; }},
      {"what exerts a force", [](F* f) { f->report.sheets[0].exerted_by = "other"; }},
      {"why a witness did not run",
       [](F* f) { f->report.witnesses[1].summary = {.stop = Stop::kLimit, .message = "other", .where = {}, .unit = {}}; },
       {"text"}},
      {"steps", [](F* f) { f->report.timing.steps = 5; }},
      {"time of the loop", [](F* f) { f->report.timing.loop_s = 5; }},
      {"time of pictures", [](F* f) { f->report.timing.render_s = 5; }},
      {"time of the other engine", [](F* f) { f->report.timing.stock_s = 5; }}};
  const test::FullPage right;
  for (const FullPerturbation& perturbation : perturbations) {
    test::FullPage perturbed;
    perturbation.apply(&perturbed);
    EXPECT_EQ(ToJson(perturbed.report) == ToJson(right.report),
              perturbation.unseen.contains("json"))
        << perturbation.what;
    EXPECT_EQ(TextOf(perturbed.report) == TextOf(right.report),
              perturbation.unseen.contains("text"))
        << perturbation.what;
    EXPECT_EQ(PageOf(perturbed) == PageOf(right), perturbation.unseen.contains("page"))
        << perturbation.what;
  }
}

TEST(FullReport, OfManyColumnsTheWorstArePlotted) {
  test::FullPage full;
  EXPECT_EQ(PageOf(full).find("worst of"), std::string::npos);
  auto& columns = PairOf(&full, "simulated_vs_reference").columns;
  columns.resize(9, columns[0]);
  EXPECT_NE(PageOf(full).find("<p class=\"faint\">The 8 worst of 9 columns.</p>"),
            std::string::npos);
  columns.clear();
  const std::string page = PageOf(full);
  EXPECT_EQ(page.find("Columns of forces.csv"), std::string::npos) << "nothing was judged";
  EXPECT_NE(page.find("forces.csv: 3 rows meet 3 samples"), std::string::npos);
}

TEST(FullReport, APartOfTheEnergyThatOneWitnessLacksIsADash) {
  test::FullPage full;
  SimulatedEnergy(&full).parts.erase(SimulatedEnergy(&full).parts.begin());
  EXPECT_NE(PageOf(full).find("change: kinetic energy</th><td class=\"n\">–</td>"),
            std::string::npos);
}

TEST(FullReport, WithoutAnAuditThePageSaysWhy) {
  test::FullPage full;
  HtmlInput input = full.input();
  input.audit = HtmlAudit{.source = "", .rows = {}, .note = "the models < were not found"};
  EXPECT_NE(ToHtml(input).find("<p>the models &lt; were not found</p>"), std::string::npos);
  input.audit.reset();
  EXPECT_EQ(ToHtml(input).find("id=\"equations\""), std::string::npos);
}

}  // namespace
}  // namespace mbv
