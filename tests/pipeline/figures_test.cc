#include "pipeline/figures.h"

#include <gmock/gmock.h>

#include "pipeline/check_file.h"
#include "tests/source_dir.h"
#include "tests/test_folder.h"

namespace mbv {
namespace {

using testing::HasSubstr;

std::string FigureScenario(const std::string& name) {
  return std::string(kSourceDir) + "/scenarios/" + name + ".yaml";
}

TEST(MakeFigures, DrawsWhatAMotionAndItsRunGave) {
  FigureOptions options;
  options.formats = {"svg", "pdf"};
  options.only = {"drive_torques"};
  const FigureOutcome outcome = MakeFigures(FigureScenario("four_bar/turn_inverse"), options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.mechanism + "/" + outcome.scenario, "four_bar/turn_inverse");
  EXPECT_EQ(outcome.verdict, "agree");
  ASSERT_EQ(outcome.files.size(), 2u);
  EXPECT_EQ(outcome.files[0].first, "drive_torques.pdf");
  EXPECT_EQ(outcome.files[1].first, "drive_torques.svg");
  EXPECT_EQ(outcome.figures[0].files.size(), 2u);
}

TEST(MakeFigures, AnUnknownNameIsRefusedWithTheNearest) {
  FigureOptions options;
  options.only = {"drive_torque"};
  const FigureOutcome outcome = MakeFigures(FigureScenario("four_bar/turn_inverse"), options);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(outcome.files.empty());
  EXPECT_THAT(outcome.diagnostics.Text(), HasSubstr("did you mean 'drive_torques'?"));
}

TEST(MakeFigures, OfAStiffnessAreTheUsualMaps) {
  FigureOptions options;
  options.formats = {"svg"};
  const FigureOutcome outcome = MakeFigures(FigureScenario("scara_robot/stiffness"), options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  ASSERT_FALSE(outcome.figures.empty());
  EXPECT_THAT(outcome.figures[0].figure.name, HasSubstr("map_x_y_"));
  EXPECT_EQ(outcome.figures.size(), outcome.files.size());
}

// A turn of the four-bar with figures of its own.
std::string TurnWith(const std::string& figures) {
  return "mechanism: " + std::string(kSourceDir) + "/models/four_bar/model.yaml\n" +
         "motion:\n  duration_s: 1\n  sample_s: 0.01\n  commands:\n"
         "    motor: [home, {cycloid: {duration_s: 1, delta: 1}}]\n"
         "simulation: {mode: inverse}\nfigures:\n" +
         figures;
}

std::string FindingsOf(const std::string& figures) {
  const test::TestFolder folder("own_figures");
  const std::string file = folder.Write("t.yaml", TurnWith(figures));
  std::string text = CheckFile(file).Text();
  for (size_t at = 0; (at = text.find(file)) != std::string::npos;) {
    text.replace(at, file.size(), "t.yaml");
  }
  return text;
}

TEST(OwnFigures, KnowForeignWitnesses) {
  FigureOptions options;
  options.formats = {"pgf"};
  options.only = {"outside"};
  const FigureOutcome outcome = MakeFigures(FigureScenario("four_bar/foreign"), options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  ASSERT_EQ(outcome.figures.size(), 1u);
  EXPECT_EQ(outcome.figures[0].figure.panels[0].curves.size(), 2u);
  options.scenario.set = {{"witnesses", "{other: {command: [x]}}"}};
  EXPECT_THAT(MakeFigures(FigureScenario("four_bar/foreign"), options).diagnostics.Text(),
              HasSubstr("= 'planar' is no witness"));
}

TEST(OwnFigures, AreDrawnBesideTheUsualOnesAndReplaceThoseOfTheirName) {
  const test::TestFolder folder("own_drawn");
  FigureOptions options;
  options.formats = {"pgf"};
  const FigureOutcome outcome = MakeFigures(
      folder.Write("t.yaml", TurnWith("  - {name: drive_torques, signals: motor.force, "
                                      "caption: Mine}\n  - {name: rates, panels: [{signals: "
                                      "motor.velocity}, {signals: motor.acceleration}]}\n")),
      options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  std::vector<std::string> names;
  for (const MadeFigure& made : outcome.figures) names.push_back(made.figure.name);
  EXPECT_THAT(names, testing::ElementsAre("drive_torques", "rates", "drive_angles", "power_energy",
                                          "torque_speed"));
  EXPECT_EQ(outcome.figures[0].figure.caption, "Mine");
  EXPECT_EQ(outcome.figures[1].figure.panels.size(), 2u);
}

TEST(OwnFigures, MistakesOfFormAreAllToldWithTheirPlaces) {
  EXPECT_EQ(FindingsOf("  - {signals: motor.force}\n"
                       "  - {name: ../up, signals: []}\n"
                       "  - {name: a, panels: [{signals: motor.force, colour: red}], x: q}\n"
                       "  - {name: a, signals: motor.force, width_mm: 2, log: maybe}\n"),
            R"(t.yaml:9:5: error: figures[0]: 'name' is missing
t.yaml:10:12: error: figures[1].name = '../up' is no name of files
  hint: write a letter, then letters, digits and '_', at most 64 characters
t.yaml:10:28: error: figures[1].signals is empty: there is nothing to draw
t.yaml:11:47: error: figures[2].panels[0]: unknown key 'colour'
  hint: known keys: signals, witnesses, marks, difference_to, x, unit, x_unit, label, x_label, names, log, legend, share, from_start, equal_scale
t.yaml:11:62: error: figures[2]: unknown key 'x'
  hint: known keys: name, caption, width_mm, height_mm, panels
t.yaml:12:5: error: figures[3].name = 'a': another figure has this name
t.yaml:12:47: error: figures[3].width_mm = 2 violates 20 <= width_mm <= 500
t.yaml:12:55: error: figures[3].log = 'maybe' is neither true nor false
)");
}

TEST(OwnFigures, NamesAndUnitsThatDoNotFitAreAllToldWithTheirPlaces) {
  EXPECT_EQ(
      FindingsOf("  - {name: a, signals: motor.forse}\n"
                 "  - {name: b, signals: [motor.force, motor.position]}\n"
                 "  - {name: c, signals: motor.force, unit: kN}\n"
                 "  - {name: d, signals: motor.*n, witnesses: [simulatd]}\n"
                 "  - {name: e, signals: motor.force, x: motor.positon}\n"
                 "  - {name: f, signals: motor.force, difference_to: table}\n"),
      R"(t.yaml:9:24: error: figures[0].signals = 'motor.forse': no witness records such a signal
  hint: did you mean 'motor.force'?
t.yaml:10:38: error: figures[1].signals[1] = 'motor.position': 'motor.position' is in rad, others of the panel in N m
  hint: a panel has one unit: give it panels
t.yaml:11:43: error: figures[2].unit = 'kN' is no unit of what is recorded in N m
  hint: did you mean 'kN m'?
t.yaml:12:24: error: figures[3].signals = 'motor.*n': 'motor.acceleration' is in rad/s^2, others of the panel in rad
  hint: a panel has one unit: give it panels
t.yaml:12:46: error: figures[3].witnesses[0] = 'simulatd' is no witness
  hint: did you mean 'simulated'?
t.yaml:13:40: error: figures[4].x = 'motor.positon': no witness records such a signal
  hint: did you mean 'motor.position'?
t.yaml:14:52: error: figures[5].difference_to = 'table' is no witness
  hint: witnesses: analytic, reference, simulated, solver, reached
)");
}

}  // namespace
}  // namespace mbv
