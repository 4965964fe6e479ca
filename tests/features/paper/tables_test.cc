#include "features/paper/tables.h"

#include <gmock/gmock.h>

#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

using testing::HasSubstr;

std::string TablesScenario(const std::string& name) {
  return std::string(kSourceDir) + "/scenarios/" + name + ".yaml";
}

const Table* FindTable(const TablesOutcome& outcome, const std::string& name) {
  for (const Table& table : outcome.tables) {
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
  // The law by hand: docs/how-to/size_motors.md works this machine out (0.19981 N m, 0.1073 N m
  // RMS, 40 π rad/s, 30 % of the rated speed); a stop by the brake asks more of the gearbox.
  EXPECT_THAT(Texts(outcome.tables[0].rows.at(0)),
              testing::ElementsAre("motor", "0.2 N m", "0.107 N m", "126 rad/s", "23.7 W", "55.6 %",
                                   "gearbox emergency"));
  options.scenario.set = {{"motion.duration_s", "0.1"}};
  const TablesOutcome shorter = MakeTables(TablesScenario("slider_crank/motor"), options);
  ASSERT_EQ(shorter.tables.size(), 1u) << shorter.diagnostics.Text();
  EXPECT_NE(shorter.tables[0].rows.at(0), outcome.tables[0].rows.at(0)) << "of another motion";
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

TEST(StatedNumbers, OfPartsAreThoseOfEachInstance) {
  const test::TestFolder folder("stated_parts");
  const auto stated = StatedNumbers(folder.Write("model.yaml", R"(
parts:
  limb:
    parameters: {m: {value: 1.50, unit: kg}, l: {value_mm: 300.0, unit: m}, a: 2*m}
    instances: {foot: {part: foot, r: 0.10}}
  foot: {parameters: {r: 0.200, t: {value: 5.0, unit: s}}}
instances: {limb1: {part: limb}, limb2: {part: limb, m: 2.0, l: 2*0.15}, none: {part: nowhere}}
)"));
  const auto text = [&](const char* name) {
    const auto at = stated.find(name);
    return at == stated.end() ? "" : at->second.text + " " + at->second.unit;
  };
  EXPECT_EQ(text("limb1.m"), "1.50 kg");
  EXPECT_EQ(text("limb2.m"), "2.0 kg");
  EXPECT_EQ(stated.at("limb2.m").value, 2.0);
  EXPECT_EQ(text("limb1.l"), "300.0 mm");
  EXPECT_EQ(text("limb2.l"), "");  // an expression of the instance's
  EXPECT_EQ(text("limb1.a"), "");
  EXPECT_EQ(text("limb1.foot.r"), "0.10 ");
  EXPECT_EQ(text("limb2.foot.t"), "5.0 s");
  EXPECT_EQ(stated.size(), 7U);
}

}  // namespace
}  // namespace mbv
