// The writers' texts, literally: a report made by hand must give the files in golden/.
// To renew them after an intended change: MBV_UPDATE_GOLDEN=1 test_report, then read the diff.
#include "report/report.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/comparison/synthetic.h"
#include "tests/source_dir.h"

namespace mbv {
namespace {

using synthetic::Bend;
using synthetic::Case;

std::string Golden(const std::string& name, const std::string& actual) {
  const std::string path = std::string(kSourceDir) + "/tests/report/golden/" + name;
  if (std::getenv("MBV_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << actual;
  std::ifstream stream(path);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

// Keeps the first three samples.
Trace Shortened(Trace trace) {
  trace.time_s.resize(3);
  trace.values = trace.values.topRows(3).eval();
  return trace;
}

Report MakeReport(const Case& c) {
  Report report;
  report.scenario = "bent";
  report.scenario_file = "scenarios/two_sliders/bent.yaml";
  report.mechanism = "two_sliders";
  report.model_file = "models/two_sliders/model.yaml";
  report.description = "Two sliders carry a plate";
  report.drives = {"d1", "d2"};
  report.simulation = "forward simulation, step 1 ms, corrected engine";
  report.mode = "forward";
  report.step_s = 1e-3;
  report.duration_s = 1.0;
  report.sample_s = 0.01;
  report.driven_by = "analytic";
  report.comparison = c.Run();
  report.exit_code = 1;
  report.witnesses = {{"analytic", c.analytic_summary, Shortened(c.analytic)},
                      {"reference", c.reference_summary, {}},
                      {"simulated", c.simulated_summary, Shortened(c.simulated)}};
  Finding finding;
  finding.severity = Severity::kWarning;
  finding.message = "MuJoCo: a warning";
  report.findings.Add(finding);
  report.sheets = SheetsOf(c.mechanism, report.comparison);
  report.engine_comparison =
      EngineComparison{.truth = "analytic",
                       .engines = {{"defaults", kNan, kNan, kNan, kNan, "it diverged"},
                                   {"stock", 1.5e-3, 2e-3, 2.1e-6, 3.4e-6},
                                   {"corrected", 4.2e-8, 5e-8, 1.7e-9, 4.1e-8}}};
  report.timing = {.analytic_s = 0.001,
                   .reference_s = 0.0,
                   .simulation_s = 0.5,
                   .stock_s = 0.25,
                   .render_s = 0.125,
                   .total_s = 1.0,
                   .loop_s = 0.4,
                   .steps = 1000};
  report.versions = {{"mbverify", "0.1.0"}};
  report.pictures = {"t_0.000s.png"};
  return report;
}

// Simulation 1 % off on d1 only; the reference was switched off; one check is off.
Case BentCase() {
  Case c;
  c.column = LimitColumn::kForward;
  c.limits[Metric::kForceMax].forward.reset();
  synthetic::Stretch(&c.simulated, "d1.force", 1.01);
  c.simulated.values(40, c.simulated.Find("plate.x")) = kNan;
  c.reference_summary = {.message = "switched off in the scenario", .where = {}, .unit = {}};
  for (const char* component : {"fx", "fy", "fz", "mx", "my", "mz"}) {
    c.reactions_not_unique.push_back(std::string("slide2.reaction.") + component);
  }
  return c;
}

TEST(Report, SummaryJsonIsAsWritten) {
  const std::string json = ToJson(MakeReport(BentCase()));
  EXPECT_EQ(json, Golden("summary.json", json));
}

TEST(Report, VerdictTableIsAsWritten) {
  const std::string table = ToTable(MakeReport(BentCase()), {});
  EXPECT_EQ(table, Golden("table.txt", table));
}

TEST(Report, VerboseTableIsAsWritten) {
  const std::string table = ToTable(MakeReport(BentCase()), {.color = false, .verbose = true});
  EXPECT_EQ(table, Golden("table_verbose.txt", table));
}

TEST(Report, ColourAddsEscapesAndNothingElse) {
  const Report report = MakeReport(BentCase());
  std::string colored = ToTable(report, {.color = true, .verbose = false});
  EXPECT_NE(colored.find("\x1b[1;31mDISAGREE\x1b[0m"), std::string::npos);
  for (size_t at; (at = colored.find('\x1b')) != std::string::npos;) {
    colored.erase(at, colored.find('m', at) - at + 1);
  }
  EXPECT_EQ(colored, ToTable(report, {}));
}

TEST(Report, JsonHasTheFieldsOthersRelyOn) {
  const auto json = nlohmann::json::parse(ToJson(MakeReport(BentCase())));
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
  EXPECT_TRUE(metrics["pose_max_m"].is_null());  // a NaN is no number and never passes
  for (const char* key : {"analytic_s", "reference_s", "simulation_s", "render_s", "steps"}) {
    EXPECT_TRUE(json["timing"].contains(key)) << key;
  }
}

TEST(Report, CsvHasDrivesFirstInTheOrderOfTheWitnesses) {
  const std::string csv = ToCsv(MakeReport(BentCase()));
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
  const Case c = BentCase();
  std::istringstream csv(ToCsv(MakeReport(c)));
  std::string line;
  for (int i = 0; i < 3; ++i) std::getline(csv, line);  // header, t = 0, t = 0.01
  std::istringstream cells(line);
  std::string cell;
  for (int k = 0; k <= 4; ++k) std::getline(cells, cell, ',');
  EXPECT_EQ(std::stod(cell), c.analytic.values(1, c.analytic.Find("d1.force")));
}

TEST(Report, CountsTellRanComparedAndVerifiedApart) {
  const Report agreed = MakeReport(Case());
  const Report disagreed = MakeReport(BentCase());
  Case alone;
  alone.reference_summary = alone.simulated_summary = {.message = "off", .where = {}, .unit = {}};
  const Report ran_only = MakeReport(alone);
  RunCounts counts{.scenarios = 1, .bad_input = 1};
  for (const Report* report : {&agreed, &disagreed, &ran_only}) counts += CountOf(ViewOf(*report));
  EXPECT_EQ(CountLine(counts), "4 scenarios: 3 ran, 2 compared, 1 verified, 1 with bad input\n");
}

TEST(Report, TheShortLineNamesVerdictValueAndLimit) {
  EXPECT_EQ(VerdictLine(ViewOf(MakeReport(BentCase())), {}),
            "two_sliders / bent: DISAGREE  simulated vs analytic 9.3e-03 (limit 1.0e-06)  3 of 18 "
            "checks exceed their limits\n");
}

}  // namespace
}  // namespace mbv
