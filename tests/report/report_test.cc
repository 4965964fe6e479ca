// The writers' texts, literally: a report made by hand must give the files in golden/.
#include "report/report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/golden_file.h"
#include "tests/support/reports.h"

namespace mbv {
namespace {

using synthetic::Case;
using test::MakeReport;
using test::PerturbedCase;

TEST(Report, SummaryJsonIsAsWritten) {
  const std::string json = ToJson(MakeReport(PerturbedCase()));
  ExpectGolden("summary.json", json);
}

TEST(Report, VerdictTableIsAsWritten) {
  const std::string table = ToTable(MakeReport(PerturbedCase()), {});
  ExpectGolden("table.txt", table);
}

TEST(Report, VerboseTableIsAsWritten) {
  const std::string table = ToTable(MakeReport(PerturbedCase()), {.color = false, .verbose = true});
  ExpectGolden("table_verbose.txt", table);
}

TEST(Report, ColourAddsEscapesAndNothingElse) {
  const Report report = MakeReport(PerturbedCase());
  std::string colored = ToTable(report, {.color = true, .verbose = false});
  EXPECT_NE(colored.find("\x1b[1;31mDISAGREE\x1b[0m"), std::string::npos);
  for (size_t at; (at = colored.find('\x1b')) != std::string::npos;) {
    colored.erase(at, colored.find('m', at) - at + 1);
  }
  EXPECT_EQ(colored, ToTable(report, {}));
}

TEST(Report, JsonHasTheFieldsOthersRelyOn) {
  const auto json = nlohmann::json::parse(ToJson(MakeReport(PerturbedCase())));
  for (const char* key : {"schema", "scenario", "mechanism", "verdict", "checks", "drives",
                          "metrics", "timing", "versions"}) {
    EXPECT_TRUE(json.contains(key)) << key;
  }
  EXPECT_EQ(json["verdict"], "disagree");
  for (const auto& check : json["checks"]) {
    for (const char* key : {"name", "value", "limit", "pass", "time_s", "channel"}) {
      EXPECT_TRUE(check.contains(key)) << key;
    }
  }
  const auto& metrics = json["metrics"]["simulated_vs_analytic"];
  for (const char* key : {"force_nrmse", "force_max_rel", "pose_max_m", "pose_max_rad",
                          "closure_max_m", "power_balance_rel"}) {
    EXPECT_TRUE(metrics.contains(key)) << key;
  }
  EXPECT_TRUE(metrics["pose_max_m"].is_null());  // a NaN is not a number and never passes
  for (const char* key : {"analytic_s", "reference_s", "simulation_s", "render_s", "steps"}) {
    EXPECT_TRUE(json["timing"].contains(key)) << key;
  }
}

TEST(Report, JsonStatesWhoAgreesBesideWhoIsNamed) {
  Report report = MakeReport(PerturbedCase());
  const auto without = nlohmann::json::parse(ToJson(report))["attribution"];
  EXPECT_FALSE(without.contains("agree"));
  report.comparison.attribution.split = Attribution::Split{.agree = {"reference", "analytic"},
                                                           .agree_to = 1e-12,
                                                           .differs = "simulated",
                                                           .differs_by = 2e-3,
                                                           .measure = "drive force, RMS",
                                                           .unit = "",
                                                           .shared = "one number"};
  const auto json = nlohmann::json::parse(ToJson(report))["attribution"];
  EXPECT_EQ(json["agree"], (std::vector<std::string>{"reference", "analytic"}));
  EXPECT_EQ(json["agree_to"], 1e-12);
  EXPECT_EQ(json["differs"], "simulated");
  EXPECT_EQ(json["differs_by"], 2e-3);
  EXPECT_EQ(json["measure"], "drive force, RMS");
  EXPECT_EQ(json["unit"], "");
  EXPECT_EQ(json["shared"], "one number");
}

// The line of a disagreement quotes a check that fails, though the usual one passes.
TEST(Report, TheVerdictLineQuotesNoNumberThatPasses) {
  Report report = MakeReport(PerturbedCase());
  ResultView view = ViewOf(report);
  view.verdict = Verdict::kDisagree;
  view.main_pair = "simulated vs analytic";
  view.main_check = "simulated_vs_analytic.force_nrmse";
  view.checks = {{.name = view.main_check,
                  .subject = "",
                  .title = "",
                  .value = 2e-11,
                  .limit = 1e-10,
                  .pass = true},
                 {.name = "simulated.power_balance",
                  .subject = "",
                  .title = "",
                  .value = 3e-7,
                  .limit = 1e-8,
                  .pass = false},
                 {.name = "simulated.energy_drift",
                  .subject = "",
                  .title = "",
                  .value = 3e-4,
                  .limit = 1e-5,
                  .pass = false},
                 {.name = "simulated.closure_m",
                  .subject = "",
                  .title = "",
                  .value = kNan,
                  .limit = {},
                  .pass = false}};
  EXPECT_NE(VerdictLine(view, {}).find("  simulated.power_balance 3.0e-07 (limit 1.0e-08)"),
            std::string::npos)
      << VerdictLine(view, {});
  view.checks[0].pass = false;
  EXPECT_NE(VerdictLine(view, {}).find("  simulated vs analytic 2.0e-11"), std::string::npos);
  view.checks[0].pass = true;
  view.verdict = Verdict::kAgree;
  EXPECT_NE(VerdictLine(view, {}).find("  simulated vs analytic 2.0e-11"), std::string::npos);
}

TEST(Report, CsvHasDrivesFirstInTheOrderOfTheWitnesses) {
  const std::string csv = ToCsv(MakeReport(PerturbedCase()));
  const std::string start =
      "time_s,d1.position.analytic,d1.velocity.analytic,d1.acceleration.analytic,d1.force.analytic,"
      "d1.position.simulated,d1.velocity.simulated,d1.acceleration.simulated,d1.force.simulated,"
      "d2.position.analytic,";
  EXPECT_EQ(csv.substr(0, start.size()), start);
  EXPECT_EQ(csv.find(".reference"), std::string::npos);
  EXPECT_NE(csv.find(",plate.x.analytic,"), std::string::npos);
  // Header, three samples.
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
}

TEST(Report, CsvNumbersReadBackExactly) {
  const Case c = PerturbedCase();
  std::istringstream csv(ToCsv(MakeReport(c)));
  std::string line;
  for (int i = 0; i < 3; ++i) std::getline(csv, line);  // header, t = 0, t = 0.01
  std::istringstream cells(line);
  std::string cell;
  for (int k = 0; k <= 4; ++k) std::getline(cells, cell, ',');
  EXPECT_EQ(std::stod(cell), c.analytic.values(1, c.analytic.Find("d1.force")));
}

// Where friction sticks there is no value; the ends of the band stand beside it.
TEST(Report, CsvGivesTheEndsOfABandAndNoMiddle) {
  Report report = MakeReport(PerturbedCase());
  Trace& trace = report.witnesses[0].trace;
  trace.channels.push_back(MakeChannel(Quantity::kForceBand, "N", "d1"));
  trace.values.conservativeResize(Eigen::NoChange, trace.values.cols() + 1);
  trace.values.rightCols(1) << 0.0, 0.0, 7.5;
  trace.values(2, trace.Find("d1.force")) = 2.0;
  std::istringstream csv(ToCsv(report));
  std::string line, last;
  std::getline(csv, line);
  EXPECT_NE(line.find("d1.force.analytic,d1.force.lower.analytic,d1.force.upper.analytic,"),
            std::string::npos);
  EXPECT_EQ(line.find("band"), std::string::npos);
  while (std::getline(csv, line)) last = line;
  EXPECT_NE(last.find(",nan,-5.5,9.5,"), std::string::npos) << last;
}

TEST(Report, SamplesAtRestAreReported) {
  synthetic::Case c = PerturbedCase();
  Trace& trace = c.simulated;
  trace.channels.push_back(MakeChannel(Quantity::kForceBand, "N", "d1"));
  trace.values.conservativeResize(Eigen::NoChange, trace.values.cols() + 1);
  trace.values.rightCols(1).setZero();
  trace.values.rightCols(1).bottomRows(4).setConstant(3.0);
  const Report report = MakeReport(c);
  EXPECT_NE(ToTable(report, {}).find("friction rests at 4 of 101 samples"), std::string::npos);
  EXPECT_EQ(
      nlohmann::json::parse(ToJson(report))["metrics"]["simulated_vs_analytic"]["samples_at_rest"],
      4);
}

TEST(Report, CountsTellRanComparedAndVerifiedApart) {
  const Report agreed = MakeReport(Case());
  const Report disagreed = MakeReport(PerturbedCase());
  Case alone;
  alone.reference_summary = alone.simulated_summary = {.message = "off", .where = {}, .unit = {}};
  const Report ran_only = MakeReport(alone);
  RunCounts counts{.scenarios = 1, .bad_input = 1};
  for (const Report* report : {&agreed, &disagreed, &ran_only}) counts += CountOf(ViewOf(*report));
  EXPECT_EQ(CountLine(counts), "4 scenarios: 3 ran, 2 compared, 1 verified, 1 with bad input\n");
}

TEST(Report, TheShortLineNamesVerdictValueAndLimit) {
  EXPECT_EQ(
      VerdictLine(ViewOf(MakeReport(PerturbedCase())), {}),
      "two_sliders / perturbed: DISAGREE  simulated vs analytic 9.3e-03 (limit 1.0e-06)  3 of 18 "
      "checks exceed their limits\n");
}

TEST(Report, CsvOfAnySizeHasARowForEachSample) {
  Report report = MakeReport(PerturbedCase());
  Trace& trace = report.witnesses[0].trace;
  trace.Reset(SampleTimes(50.0, 0.005), DriveChannels(synthetic::TwoSliders()));
  trace.witness = "analytic";
  for (Eigen::Index i = 0; i < trace.values.rows(); ++i) trace.values.row(i).setConstant(i);
  report.witnesses.resize(1);
  std::istringstream csv(ToCsv(report));
  std::string line;
  std::getline(csv, line);
  for (int i = 0; i <= 10000; ++i) {
    ASSERT_TRUE(std::getline(csv, line)) << i;
    ASSERT_TRUE(line.ends_with("," + std::to_string(i))) << i << ": " << line;
  }
  EXPECT_FALSE(std::getline(csv, line));
}

}  // namespace
}  // namespace mbv
