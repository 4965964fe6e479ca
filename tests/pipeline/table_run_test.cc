// A table in the reference's place, through all stages.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pipeline/run_scenario.h"
#include "tests/source_dir.h"

namespace mbv {
namespace {

std::string TableScenario(const std::string& name) {
  return std::string(kSourceDir) + "/scenarios/" + name + ".yaml";
}

std::string ResultText(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

RunOptions WithoutPictures(std::vector<SetValue> set = {}, const std::string& out = "") {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = std::move(set);
  options.out_dir = out;
  return options;
}

TEST(TableRun, WithoutClosedFormTheSolverTakesPartUnderItsOwnName) {
  const RunOutcome outcome = RunScenario(TableScenario("four_bar/table_adams"), WithoutPictures());
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.report->driven_by, "solver");
  for (const char* pair :
       {"simulated_vs_solver", "reference_vs_solver", "simulated_vs_reference"}) {
    const PairComparison* found = outcome.report->comparison.FindPair(pair);
    ASSERT_NE(found, nullptr) << pair;
    EXPECT_TRUE(found->compared) << pair;
  }
}

TEST(TableRun, WithAClosedFormTheTableIsJudgedByIt) {
  const RunOutcome outcome = RunScenario(TableScenario("spr_tripod/table"),
                                         WithoutPictures({{"analytic", "{model: full}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.report->comparison.reason;
  EXPECT_EQ(outcome.report->driven_by, "analytic");
  ASSERT_TRUE(outcome.report->comparison.table);
  EXPECT_EQ(outcome.report->comparison.table->judged_against, "analytic");
  // The table is this closed form's, rounded: half a unit of the last of five digits.
  const PairComparison* pair = outcome.report->comparison.FindPair("reference_vs_analytic");
  ASSERT_NE(pair, nullptr);
  for (const TableColumnResult& column : pair->columns) EXPECT_LE(column.error_max, 5.01e-3);
  EXPECT_EQ(outcome.report->comparison.FindPair("simulated_vs_solver"), nullptr);
}

TEST(TableRun, AParameterThatIsOnePercentOffIsSeenThroughTheTable) {
  const RunOutcome outcome = RunScenario(TableScenario("four_bar/table_matlab"),
                                         WithoutPictures({{"parameters", "{rho: 2.02}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.report->comparison.attribution.odd_one_out, "reference");
  const std::vector<std::string>& diagnoses = outcome.report->comparison.table->diagnoses;
  ASSERT_FALSE(diagnoses.empty());
  EXPECT_NE(diagnoses[0].find("0.990"), std::string::npos) << diagnoses[0];  // 1/1.01
}

TEST(TableRun, ATableOutsideTheMotionIsNotRunAndSaysSo) {
  const RunOutcome outcome = RunScenario(TableScenario("four_bar/table_adams"),
                                         WithoutPictures({{"reference.time_offset_s", "100"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 3);
  bool said = false;
  for (const WitnessRecord& witness : outcome.report->witnesses) {
    said = said || witness.summary.message.find("no row of adams.tab lies inside the motion") !=
                       std::string::npos;
  }
  EXPECT_TRUE(said);
}

TEST(TableRun, ATableOfAnotherMotionIsSaidToBe) {
  const RunOutcome outcome = RunScenario(
      TableScenario("four_bar/table_matlab"),
      WithoutPictures(
          {{"motion.commands.motor", "[\"pi/2\", {cycloid: {duration_s: 2, delta: pi}}]"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.report->comparison.attribution.text.find("does it belong to another motion?"),
            std::string::npos)
      << outcome.report->comparison.attribution.text;
}

TEST(TableRun, DurationAndSamplesFollowTheTableWhereTheyAreLeftOut) {
  const RunOutcome outcome =
      RunScenario(TableScenario("four_bar/table_noisy"),
                  WithoutPictures({{"motion",
                                    "{commands: {motor: [\"pi/2\", {cycloid: {duration_s: 2, "
                                    "delta: 2*pi}}]}}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.report->comparison.reason;
  EXPECT_DOUBLE_EQ(outcome.report->duration_s, 2.0);
  EXPECT_DOUBLE_EQ(outcome.report->sample_s, 0.01);
}

TEST(TableRun, FilesHoldTheTableItsTubeAndItsGaps) {
  const auto out = std::filesystem::temp_directory_path() / "mbv_table_run";
  std::filesystem::remove_all(out);
  const RunOutcome outcome =
      RunScenario(TableScenario("four_bar/table_adams"), WithoutPictures({}, out.string()));
  ASSERT_EQ(outcome.exit_code, 0);
  const std::filesystem::path folder = outcome.folder;
  const auto json = nlohmann::json::parse(ResultText(folder / "summary.json"));
  const auto& table = json["reference_table"];
  EXPECT_EQ(table["name"], "adams.tab");
  EXPECT_EQ(table["judged_against"], "solver");
  ASSERT_EQ(table["columns"].size(), 2u);
  const auto& force = table["columns"][0];
  EXPECT_EQ(force["signal"], "motor.force");
  EXPECT_EQ(force["column"], "MOTION_1.TM");
  EXPECT_DOUBLE_EQ(force["factor"].get<double>(), -1e-3);  // N mm, turned round
  EXPECT_GT(force["uncertainty"]["digits"].get<double>(), 0.0);
  for (const char* pair : {"reference_vs_solver", "simulated_vs_reference"}) {
    const auto& judged = force["judged"][pair];
    EXPECT_TRUE(judged["inside"].get<bool>()) << pair;
    EXPECT_LE(judged["error_max"].get<double>(), judged["tube_max"].get<double>()) << pair;
  }
  bool widened = false;
  for (const auto& check : json["checks"]) widened = widened || check.contains("stated_limit");
  EXPECT_TRUE(widened);
  // Every second sample has a row: one number, one gap.
  std::istringstream csv(ResultText(folder / "traces.csv"));
  std::string head, first, second;
  std::getline(csv, head);
  std::getline(csv, first);
  std::getline(csv, second);
  ASSERT_NE(head.find("motor.force.reference"), std::string::npos) << head;
  EXPECT_EQ(first.find("nan"), std::string::npos) << first;
  EXPECT_NE(second.find("nan"), std::string::npos) << second;
  const std::string page = ResultText(folder / "report.html");
  for (const char* text : {"The table in the reference's place",
                           "Columns of adams.tab against "
                           "solver",
                           "motor.force: adams.tab − solver", "tube ±"}) {
    // Apostrophes are escaped.
    std::string wanted = text;
    if (const size_t at = wanted.find('\''); at != std::string::npos) wanted.resize(at);
    EXPECT_NE(page.find(wanted), std::string::npos) << text;
  }
  std::filesystem::remove_all(out);
}

}  // namespace
}  // namespace mbv
