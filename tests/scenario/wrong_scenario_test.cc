// What is said about wrong scenario files, word for word.
#include "tests/scenario/load_scenario_fixture.h"

namespace mbv {
namespace {

struct Golden {
  const char* name;
  std::string text;
  std::string messages;
};

class WrongScenario : public LoadScenarioTest, public testing::WithParamInterface<Golden> {
 public:
  using LoadScenarioTest::Complete;
};

TEST_P(WrongScenario, IsExplained) {
  const ScenarioResult result = Load(GetParam().text);
  EXPECT_FALSE(result.scenario);
  EXPECT_EQ(result.diagnostics.Text(), GetParam().messages);
}

std::string At(const std::string& place, const std::string& rest) {
  return std::string(kScenarioFile) + ":" + place + ": error: " + rest + "\n";
}

std::vector<Golden> Goldens() {
  const auto complete = [](const std::string& more) { return WrongScenario::Complete(more); };
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = complete("");
    return text.replace(text.find(from), from.size(), to);
  };
  return {
      {"Empty", "", At("1:1", "the file is empty")},
      {"NotAMap", "- 1\n", At("1:1", "the file is a list of 1, a map is needed")},
      {"NoMechanism", "motion: {}\n", At("1:1", "the file: 'mechanism' is missing")},
      {"UnknownMechanism", "mechanism: stabilising_platform\nmotion: {}\n",
       At("1:12",
          "mechanism = 'stabilising_platform': there is no such model\n"
          "  hint: did you mean 'stabilizing_platform'?")},
      {"NoMotion", "mechanism: stabilizing_platform\n", At("1:1", "the file: 'motion' is missing")},
      {"UnknownKey", complete("chekcs: {}\n"),
       At("16:1", "the file: unknown key 'chekcs'\n  hint: did you mean 'checks'?")},
      {"UnknownCommand", replaced("platform.z:", "platfrom.z:"),
       At("9:5",
          "motion.commands: stabilizing_platform has no coordinate 'platfrom.z'\n"
          "  hint: did you mean 'platform.z'?")},
      {"UnknownDriveInCoupling", replaced("[limb2.drive, limb2", "[limb4.drive, limb2"),
       At("14:8",
          "motion.equal[1]: stabilizing_platform has no coordinate 'limb4.drive'\n"
          "  hint: did you mean 'limb1.drive'?")},
      {"TooFewCommands", replaced("    pitch: 0\n", ""),
       At("3:3",
          "motion gives 8 commands, but stabilizing_platform has 9 degrees of freedom\n"
          "  hint: command drives, joints, outputs (OUTPUT.x …), prescribed joints, or couple "
          "drives under motion.equal; what moves by forces needs motion.initial; not held yet: "
          "pitch, "
          "platform_free, limb1.U1, limb1.U1_p, limb1.R12, limb1.R12_p, limb1.R22, limb1.S, …")},
      {"TooManyCommands", replaced("    pitch: 0\n", "    pitch: 0\n    platform.yaw: 0\n"),
       At("3:3",
          "motion gives 10 commands, but stabilizing_platform has 9 degrees of freedom\n"
          "  hint: leave commands out: each further one contradicts the others; platform.yaw, "
          "limb1.drive - limb1.drive_p, limb2.drive - limb2.drive_p, limb3.drive - limb3.drive_p "
          "are dependent")},
      {"CoupledWithItself", replaced("[limb1.drive, limb1.drive_p]", "[limb1.drive, limb1.drive]"),
       At("13:7",
          "motion.equal[0]: limb1.drive and limb1.drive are not two coordinates of one "
          "unit")},
      {"DegreesForALength", replaced("z_0 + 0.25", "{value_deg: 3}"),
       At("9:29",
          "motion.commands.platform.z.value_deg is given, but this value is in m\n"
          "  hint: write motion.commands.platform.z.value")},
      {"MillimetresForAnAngle",
       replaced("pitch: 0", "pitch: {sine: {amplitude_mm: 1, period_s: 1}}"),
       At("7:34",
          "motion.commands.pitch.sine.amplitude_mm is given, but this value is in rad\n"
          "  hint: write motion.commands.pitch.sine.amplitude")},
      {"NegativeDuration", replaced("duration_s: 12", "duration_s: -12"),
       At("3:15", "motion.duration_s = -12 violates motion.duration_s > 0")},
      {"UnknownParameterInAnExpression", replaced("z_0 + 0.25", "z_o + 0.25"),
       At("9:17",
          "motion.commands.platform.z = 'z_o + 0.25' has the unknown symbol 'z_o'\n"
          "  hint: did you mean 'z_0'?")},
      {"StepLongerThanTheSample", complete("simulation: {step_s: 0.03}\n"),
       At("16:13",
          "simulation.step_s = 0.03 violates motion.sample_s = 0.01 = n · step_s\n"
          "  hint: samples must fall on whole steps")},
      {"UnknownLoadBody", complete("loads: {w: {on: platfrm, force: [0, 0, 1]}}\n"),
       At("16:17",
          "loads.w.on = 'platfrm' is not a body, frame or output of stabilizing_platform\n"
          "  hint: did you mean 'platform'?")},
      {"LoadWithoutForce", complete("loads: {w: {on: platform}}\n"),
       At("16:9", "loads.w has neither force nor moment")},
      {"WitnessParameter", complete("analytic: {parameters: {m_9: 1}}\n"),
       At("16:25",
          "analytic.parameters: stabilizing_platform has no parameter 'm_9'\n"
          "  hint: did you mean 'm_p'?")},
      {"SnapshotAfterTheEnd", complete("snapshots: {times_s: [0, 13]}\n"),
       At("16:22", "snapshots.times_s = 13 violates 0 <= t <= 12")},
      {"GhostAfterTheEnd", complete("snapshots: {ghosts: [1, 13]}\n"),
       At("16:21", "snapshots.ghosts = 13 violates 0 <= t <= 12")},
      {"HalfAGhost", complete("snapshots: {ghosts: 2.5}\n"),
       At("16:21",
          "snapshots.ghosts = 2.5 is not a whole number from 0 to 50\n"
          "  hint: a list gives times: ghosts: [0.2, 0.4]")},
      {"UnknownBackground", complete("snapshots: {background: transparant}\n"),
       At("16:25",
          "snapshots.background: 'transparant' is neither default, transparent, a colour's name "
          "nor "
          "\"#rrggbb\"\n"
          "  hint: did you mean 'transparent'?")},
      {"UnknownLabel", complete("snapshots: {labels: [joints, platfrom]}\n"),
       At("16:30",
          "snapshots.labels: the mechanism has no output, drive, joint, frame or body 'platfrom'\n"
          "  hint: did you mean 'platform'?")},
      {"UnknownStyle", complete("snapshots: {style: lineart}\n"),
       At("16:20",
          "snapshots.style = 'lineart' is not one of: shaded, line_art\n"
          "  hint: did you mean 'line_art'?")},
      {"ExplodedInwards", complete("snapshots: {exploded: 0.5}\n"),
       At("16:23", "snapshots.exploded = 0.5 violates 1 <= exploded <= 10")},
      {"UnknownProjection", complete("snapshots: {camera: {projection: ortho}}\n"),
       At("16:34",
          "snapshots.camera.projection = 'ortho' is not one of: perspective, orthographic")},
      {"NegativeLimit", complete("checks: {force_max: -1}\n"),
       At("16:21", "checks.force_max = -1 violates checks.force_max > 0")},
      {"SyntaxError", "mechanism: [\n", At("1:12", "YAML syntax: the bracket [ is never closed")},
  };
}

INSTANTIATE_TEST_SUITE_P(Golden, WrongScenario, testing::ValuesIn(Goldens()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mbv
