#include "pipeline/tables.h"

#include <gmock/gmock.h>

#include "tests/source_dir.h"
#include "tests/test_folder.h"

namespace mbv {
namespace {

using testing::HasSubstr;

std::string TablesScenario(const std::string& name) {
  return std::string(kSourceDir) + "/scenarios/" + name + ".yaml";
}

const PaperTable* FindTable(const TablesOutcome& outcome, const std::string& name) {
  for (const PaperTable& table : outcome.tables) {
    if (table.name == name) return &table;
  }
  return nullptr;
}

TEST(MakeTables, OfAMotionAreParametersMobilityAndChecks) {
  const TablesOutcome outcome = MakeTables(TablesScenario("four_bar/turn_inverse"), {});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.verdict, "agree");
  for (const char* name : {"parameters", "mobility", "checks"}) {
    EXPECT_NE(FindTable(outcome, name), nullptr) << name;
  }
  EXPECT_EQ(outcome.files.size(), 2 * outcome.tables.size());
  EXPECT_THAT(outcome.left_out, testing::ElementsAre("sizing: the model states no motors"));
  EXPECT_THAT(outcome.files[0].second, HasSubstr("\\label{tab:four_bar_turn_inverse_parameters}"));
}

TEST(MakeTables, MotorsOfAModelAreSized) {
  TablesOptions options;
  options.only = {"sizing"};
  const TablesOutcome outcome = MakeTables(TablesScenario("slider_crank/motor"), options);
  ASSERT_EQ(outcome.tables.size(), 1u) << outcome.diagnostics.Text();
  EXPECT_THAT(outcome.tables[0].rows.at(0).at(1), HasSubstr("N m"));
}

TEST(MakeTables, OfAStiffnessAreItsChecks) {
  TablesOptions options;
  options.only = {"checks", "sizing"};
  options.formats = {"md"};
  const TablesOutcome outcome =
      MakeTables(TablesScenario("cabin_robot/stiffness_moments"), options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  ASSERT_EQ(outcome.files.size(), 1u);
  EXPECT_EQ(outcome.files[0].first, "checks.md");
  EXPECT_EQ(outcome.left_out.size(), 1u);
}

TEST(MakeTables, BadInputGivesNoFiles) {
  TablesOptions options;
  options.scenario.set = {{"simulation.step_s", "-1"}};
  const TablesOutcome outcome = MakeTables(TablesScenario("four_bar/turn_inverse"), options);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(outcome.files.empty());
}

TEST(StatedNumbers, AreThoseOfTheNearestFileAndNoExpressions) {
  const test::TestFolder folder("stated");
  (void)folder.Write("base.yaml", "parameters: {a: 1.50, b: 2, c: {value_deg: 10.2}}\n");
  const std::string file = folder.Write(
      "model.yaml",
      "parameters_from: base.yaml\nparameters: {b: a + 1, d: {value_mm: 0.30, unit: m}}\n");
  const auto stated = StatedNumbers(file);
  ASSERT_EQ(stated.size(), 3u);
  EXPECT_EQ(stated.at("a").text, "1.50");
  EXPECT_EQ(stated.at("c").unit, "deg");
  EXPECT_NEAR(stated.at("c").value, 0.178, 1e-3);
  EXPECT_EQ(stated.at("d").text + " " + stated.at("d").unit, "0.30 mm");
  EXPECT_TRUE(StatedNumbers(folder.Write("robot.urdf", "<robot/>")).empty());
  EXPECT_TRUE(StatedNumbers("nowhere.yaml").empty());
}

}  // namespace
}  // namespace mbv
