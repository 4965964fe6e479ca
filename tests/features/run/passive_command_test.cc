// Motions commanded by coordinates of joints without a drive.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "base/files.h"
#include "features/run/run_scenario.h"
#include "report/report.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

// A model file, with one text of it replaced by another.
std::string ModelText(const std::string& path, const std::string& from = "",
                      const std::string& to = "") {
  std::string text = ReadWholeFile(SourcePath(path)).value_or("");
  const size_t at = from.empty() ? std::string::npos : text.find(from);
  EXPECT_TRUE(from.empty() || at != std::string::npos) << path << ": " << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

const char* const kAnkle = "/tests/mechanisms/parallel_ankle.yaml";
const char* const kWalk =
    "{ankle.0: {sine: {amplitude_deg: 12, period_s: 0.8}}, "
    "ankle.1: [{value_deg: 5}, {sine: {amplitude_deg: 8, period_s: 0.5}}]}";

class PassiveCommand : public testing::Test {
 protected:
  std::string Scenario(const std::string& model, const std::string& commands) const {
    (void)folder_.Write("model.yaml", model);
    return folder_.Write("scenario.yaml",
                         "mechanism: ./model.yaml\nanalytic: none\nmotion: {duration_s: 1, "
                         "sample_s: 0.02, commands: " +
                             commands + "}\n");
  }
  RunOutcome Run(const std::string& model, const std::string& commands,
                 std::vector<SetValue> set = {}) const {
    RunOptions options;
    options.pictures = false;
    options.out_dir = "";
    options.scenario.set = std::move(set);
    return RunScenario(Scenario(model, commands), options);
  }
  std::string Findings(const std::string& commands) const {
    return CheckFile(Scenario(ModelText(kAnkle), commands)).Text();
  }

  const test::TestFolder folder_{"passive_command"};
};

MatX ForcesOf(const RunOutcome& outcome, const std::string& witness) {
  for (const WitnessRecord& record : outcome.report->witnesses) {
    if (record.name != witness) continue;
    MatX forces(record.trace.values.rows(), 2);
    forces << record.trace.values.col(record.trace.Find("left.force")),
        record.trace.values.col(record.trace.Find("right.force"));
    return forces;
  }
  return {};
}

TEST_F(PassiveCommand, DriveForcesAreThoseOfTheSameMotionCommandedByAnOutput) {
  // R = Ry(pitch) Rx(roll) both times.
  const RunOutcome joints = Run(ModelText(kAnkle), kWalk);
  const RunOutcome output =
      Run(ModelText(kAnkle),
          "{foot.pitch: {sine: {amplitude_deg: 12, period_s: 0.8}}, "
          "foot.roll: [{value_deg: 5}, {sine: {amplitude_deg: 8, period_s: 0.5}}]}");
  ASSERT_TRUE(joints.report && output.report) << joints.diagnostics.Text();
  EXPECT_EQ(joints.exit_code, 0) << ToTable(*joints.report, {});
  for (const char* witness : {"reference", "simulated"}) {
    const MatX a = ForcesOf(joints, witness), b = ForcesOf(output, witness);
    ASSERT_EQ(a.rows(), 51);
    EXPECT_GT(b.cwiseAbs().maxCoeff(), 0.1);
    EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-8) << witness;
  }
}

// What holds of a drive that the command's coordinate is: position, rate and acceleration of the
// simulated joint are judged by the command.
TEST_F(PassiveCommand, EveryKindOfJointMovesInTheSimulationAsCommanded) {
  const std::string four_bar = "/models/four_bar/model.yaml", bar_C = "C: {kind: revolute,";
  const std::string motion = "{poly345: {start_s: 0.1, duration_s: 0.8, ";
  const std::string turn = ": [home, " + motion + "delta_deg: 12}}]";
  const std::string slide = ": [home, " + motion + "delta_mm: -20}}]";
  struct Case {
    std::string kind, model, commands;
  };
  const Case cases[] = {
      {"universal", ModelText(kAnkle), kWalk},
      {"universal with oblique axes", ModelText(kAnkle, "axis2: x", "axis2: [1, 0.4, 0.1]"), kWalk},
      {"revolute in the tree or closing the loop", ModelText(four_bar), "{C" + turn + "}"},
      {"revolute, the other one", ModelText(four_bar), "{D" + turn + "}"},
      {"cylindrical", ModelText(four_bar, bar_C, "C: {kind: cylindrical,"), "{C.1" + turn + "}"},
      {"planar",
       ModelText(four_bar, bar_C,
                 "P: {kind: planar, parent: world, child: coupler, axis: z}\n  " + bar_C),
       "{P.2" + turn + "}"},
      {"planar, along",
       ModelText(four_bar, bar_C,
                 "P: {kind: planar, parent: world, child: coupler, axis: z}\n  " + bar_C),
       "{P.0" + slide + "}"},
      {"prismatic", ModelText("/models/slider_crank/model.yaml"), "{D" + slide + "}"},
      {"free", ModelText("/models/stewart_balls/model.yaml"),
       "{float.0" + slide + ", float.1" + slide + ", float.2: home, platform.roll" + turn +
           ", platform.pitch: 0, platform.yaw: 0}"},
  };
  for (const Case& with : cases) {
    const RunOutcome outcome = Run(with.model, with.commands);
    ASSERT_TRUE(outcome.report) << with.kind << ": " << outcome.diagnostics.Text();
    EXPECT_EQ(outcome.exit_code, 0) << with.kind << ":\n" << ToTable(*outcome.report, {});
    for (const char* rate : {"velocity", "acceleration"}) {
      const CheckResult* check =
          outcome.report->comparison.FindCheck(std::string("simulated.command_") + rate);
      ASSERT_NE(check, nullptr) << with.kind;
      EXPECT_FALSE(check->follows) << with.kind;
    }
  }
}

TEST_F(PassiveCommand, AWrongDriveMotionMissesTheCommandInTheSimulation) {
  const RunOutcome outcome =
      Run(ModelText(kAnkle), kWalk,
          {{"reference.parameters.back", "0.0501"}, {"simulation.mode", "inverse"}});
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 1);
  for (const char* name : {"command_rad", "command_velocity", "command_acceleration"}) {
    const CheckResult* check =
        outcome.report->comparison.FindCheck(std::string("simulated.") + name);
    ASSERT_NE(check, nullptr);
    EXPECT_FALSE(check->pass) << name;
    EXPECT_EQ(check->channel.substr(0, 6), "ankle.") << name;
  }
}

TEST_F(PassiveCommand, AJointNamesTheDriveOnIt) {
  const RunOutcome outcome = Run(
      ModelText(kAnkle), "{left_hinge: {sine: {amplitude_deg: 10, period_s: 1}}, ankle.1: home}");
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(Findings("{left_hinge: 0, left: 0}").find("motion commands 'left' twice"),
            std::string::npos);
}

TEST_F(PassiveCommand, FindingsSayWhatCanBeCommandedAndHowMany) {
  const struct {
    const char *commands, *part;
  } cases[] = {
      {"{ankle.0: 0, foot.pitch: 0}", "for instance command also left\n"},
      {"{ankle.0: 0}", "for instance command also left\n"},
      {"{left: 0, right: 0, ankle.0: 0}", "ankle.0 are dependent\n"},
      {"{ankle: 0, left: 0}", "this joint has several coordinates: ankle.0, ankle.1"},
      {"{left_top.1: 0, left: 0}", "a rotation of a spherical joint has no axis"},
      {"{knee: 0, left: 0}", "any 2 independent ones can be commanded"},
  };
  for (const auto& [commands, part] : cases) {
    EXPECT_NE(Findings(commands).find(part), std::string::npos) << Findings(commands);
  }
}

TEST_F(PassiveCommand, AClosedFormIsNotApplicable) {
  RunOptions options;
  options.pictures = false;
  options.out_dir = "";
  const std::string file = folder_.Write(
      "tripod.yaml", "mechanism: " + SourcePath("/models/spr_tripod/model.yaml") +
                         "\nmotion: {duration_s: 1, sample_s: 0.05, commands: {" +
                         "platform_free.2: home, platform.x: home, platform.y: home}}\n");
  const RunOutcome outcome = RunScenario(file, options);
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_NE(ToTable(*outcome.report, {.verbose = true})
                .find("closed forms are commanded by drives and outputs"),
            std::string::npos)
      << ToTable(*outcome.report, {.verbose = true});
}

}  // namespace
}  // namespace mbv
