#include "features/paper/figures.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "features/run/run_scenario.h"
#include "tests/support/read_back.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

using testing::HasSubstr;

std::string FigureScenario(const std::string& name) {
  return std::string(kSourceDir) + "/scenarios/" + name + ".yaml";
}

// What a run records, by witness.
const Trace& RecordedBy(const RunOutcome& outcome, const std::string& witness) {
  for (const WitnessRecord& record : outcome.report->witnesses) {
    if (record.name == witness) return record.trace;
  }
  ADD_FAILURE() << witness;
  return outcome.report->witnesses.front().trace;
}

RunOutcome RunOfFigures(const std::string& name) {
  RunOptions options;
  options.pictures = false;
  return RunScenario(FigureScenario(name), options);
}

// Every sample of a signal, in order, as a curve over time.
void ExpectDrawn(const FigureCurve& curve, const Trace& trace, const std::string& signal,
                 double factor = 1.0) {
  ASSERT_EQ(curve.points.size(), trace.time_s.size()) << signal;
  const int column = trace.Find(signal);
  ASSERT_GE(column, 0) << signal;
  EXPECT_GT(trace.values.col(column).cwiseAbs().maxCoeff(), 0.0) << signal;
  for (size_t i = 0; i < curve.points.size(); ++i) {
    const double value = factor * trace.values(static_cast<Eigen::Index>(i), column);
    EXPECT_DOUBLE_EQ(curve.points[i].first, trace.time_s[i]);
    EXPECT_NEAR(curve.points[i].second, value, 1e-12 * std::abs(value)) << signal << " " << i;
  }
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
  // The torque that the run recorded, sample by sample, on the right scale.
  const RunOutcome run = RunOfFigures("four_bar/turn_inverse");
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  const Figure& figure = outcome.figures[0].figure;
  EXPECT_EQ(figure.panels[0].y.label, "Drive torque *τ* (N·m)");
  ExpectDrawn(figure.panels[0].curves[0], RecordedBy(run, "reference"), "motor.force");
  // In the file one path goes through all of its points: to the right with time, upwards with the
  // torque, on one scale each.
  const FigurePoints& points = figure.panels[0].curves[0].points;
  // (Cairo leaves out points on a straight line between their neighbours.)
  const auto value = [](const auto& a, const auto& b) { return a.second < b.second; };
  const auto [low, high] = std::ranges::minmax_element(points, value);
  size_t found = 0;
  for (const test::SvgPath& path : test::PathsOf(outcome.files[1].second)) {
    const auto& drawn = path.points;
    if (drawn.size() > points.size() || 10 * drawn.size() < 9 * points.size()) continue;
    ++found;
    const auto [top, bottom] = std::ranges::minmax_element(drawn, value);
    const double pt_per_s = (drawn.back().first - drawn.front().first) / points.back().first;
    const double pt_per_Nm = (top->second - bottom->second) / (high->second - low->second);
    EXPECT_GT(pt_per_s, 0.0);
    EXPECT_LT(pt_per_Nm, 0.0);
    size_t k = 1;
    for (const auto& [time, torque] : points) {
      const double x = drawn.front().first + pt_per_s * time;
      while (k + 1 < drawn.size() && drawn[k].first < x) ++k;
      const auto &before = drawn[k - 1], &after = drawn[k];
      const double y =
          std::lerp(before.second, after.second, (x - before.first) / (after.first - before.first));
      EXPECT_NEAR(y, bottom->second + pt_per_Nm * (torque - low->second), 0.02) << time;
    }
  }
  EXPECT_EQ(found, 1u);
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
  // Cells of the first map are stiffnesses at its poses: numbers, and not the same ones.
  ASSERT_TRUE(outcome.figures[0].figure.panels[0].map);
  const MapPlot& map = *outcome.figures[0].figure.panels[0].map;
  ASSERT_EQ(map.values.size(), static_cast<size_t>(map.columns * map.rows));
  std::vector<double> reached;
  for (const double cell : map.values) {
    if (cell == cell) reached.push_back(cell);
  }
  ASSERT_GT(reached.size(), map.values.size() / 4);
  const auto [least, most] = std::minmax_element(reached.begin(), reached.end());
  EXPECT_GT(*least, 0.0);
  EXPECT_GT(*most, 1.01 * *least);
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
  ASSERT_EQ(outcome.figures[0].figure.panels[0].curves.size(), 2u);
  const RunOutcome run = RunOfFigures("four_bar/foreign");
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  std::vector<std::string> drawn;
  for (const FigureCurve& curve : outcome.figures[0].figure.panels[0].curves) {
    for (const char* witness : {"planar", "reference", "simulated"}) {
      const Trace& trace = RecordedBy(run, witness);
      const int column = trace.Find("motor.force");
      if (curve.points.size() == trace.time_s.size() &&
          curve.points[30].second == trace.values(30, column)) {
        drawn.emplace_back(witness);
        ExpectDrawn(curve, trace, "motor.force");
        break;
      }
    }
  }
  EXPECT_THAT(drawn, testing::Contains("planar"));
  EXPECT_EQ(drawn.size(), 2u);
  options.scenario.set = {{"witnesses", "{other: {command: [x]}}"}};
  EXPECT_THAT(MakeFigures(FigureScenario("four_bar/foreign"), options).diagnostics.Text(),
              HasSubstr("= 'planar' is not a witness"));
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
  ASSERT_EQ(outcome.figures[1].figure.panels.size(), 2u);
  // motor: cycloid of 1 rad in 1 s: rate 1 − cos 2πt, acceleration 2π sin 2πt.
  const auto& panels = outcome.figures[1].figure.panels;
  for (const size_t i : {0u, 10u, 25u, 70u, 100u}) {
    const double angle = 2.0 * std::numbers::pi * 0.01 * static_cast<double>(i);
    EXPECT_NEAR(panels[0].curves[0].points.at(i).second, 1.0 - std::cos(angle), 1e-9);
    EXPECT_NEAR(panels[1].curves[0].points.at(i).second, 2.0 * std::numbers::pi * std::sin(angle),
                1e-9);
  }
}

TEST(OwnFigures, MistakesOfFormAreAllReportedWithTheirPlaces) {
  EXPECT_EQ(FindingsOf("  - {signals: motor.force}\n"
                       "  - {name: ../up, signals: []}\n"
                       "  - {name: a, panels: [{signals: motor.force, colour: red}], x: q}\n"
                       "  - {name: a, signals: motor.force, width_mm: 2, log: maybe}\n"),
            R"(t.yaml:9:5: error: figures[0]: 'name' is missing
t.yaml:10:12: error: figures[1].name = '../up' is not a name of files
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

TEST(OwnFigures, NamesAndUnitsThatDoNotFitAreAllReportedWithTheirPlaces) {
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
t.yaml:11:43: error: figures[2].unit = 'kN' is not a unit of what is recorded in N m
  hint: did you mean 'kN m'?
t.yaml:12:24: error: figures[3].signals = 'motor.*n': 'motor.acceleration' is in rad/s^2, others of the panel in rad
  hint: a panel has one unit: give it panels
t.yaml:12:46: error: figures[3].witnesses[0] = 'simulatd' is not a witness
  hint: did you mean 'simulated'?
t.yaml:13:40: error: figures[4].x = 'motor.positon': no witness records such a signal
  hint: did you mean 'motor.position'?
t.yaml:14:52: error: figures[5].difference_to = 'table' is not a witness
  hint: witnesses: analytic, reference, simulated, solver, reached
)");
}

}  // namespace
}  // namespace mbv
