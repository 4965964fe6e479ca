// Scenario files: what they mean.
#include "scenario/load_scenario.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "model_file/load_model.h"
#include "scenario/section_readers.h"
#include "tests/scenario/load_scenario_fixture.h"

namespace mbv {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

TEST_F(LoadScenarioTest, CommandsAreResolvedInSiUnits) {
  const ScenarioResult result = Load(Complete());
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const Motion& motion = result.scenario->motion;
  ASSERT_EQ(motion.commands.size(), 9u);
  const Jet roll = Evaluate(motion.commands[0].profile, 0.0);
  EXPECT_DOUBLE_EQ(roll.value, 6 * kDegree);  // the phase makes it a cosine
  EXPECT_EQ(motion.commands[0].terms[0].coordinate.kind, Coordinate::Kind::kPrescribed);
  EXPECT_DOUBLE_EQ(Evaluate(motion.commands[2].profile, 9.0).value, 1.1);
  EXPECT_EQ(motion.commands[3].name, "platform.z");
  EXPECT_EQ(motion.commands[3].terms[0].coordinate.component, 2);
  EXPECT_DOUBLE_EQ(Evaluate(motion.commands[3].profile, 0.0).value, 3.75);  // z_0 = 3.5
  EXPECT_DOUBLE_EQ(Evaluate(motion.commands[5].profile, 0.0).value, kDegree);
}

TEST_F(LoadScenarioTest, CouplingsAreDifferencesCommandedToZero) {
  const ScenarioResult result = Load(Complete());
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const Command& coupling = result.scenario->motion.commands[7];
  EXPECT_EQ(coupling.name, "limb2.drive - limb2.drive_p");
  ASSERT_EQ(coupling.terms.size(), 2u);
  EXPECT_EQ(coupling.terms[0].coordinate.index, 2);
  EXPECT_EQ(coupling.terms[1].coordinate.index, 3);
  EXPECT_EQ(coupling.terms[1].factor, -1.0);
  EXPECT_EQ(Evaluate(coupling.profile, 5.0).value, 0.0);
}

TEST_F(LoadScenarioTest, EverythingLeftOutHasADefault) {
  const ScenarioResult result = Load(Complete());
  ASSERT_TRUE(result.scenario);
  const Scenario& scenario = *result.scenario;
  EXPECT_EQ(scenario.name, "t");
  EXPECT_TRUE(scenario.analytic.on);
  EXPECT_TRUE(scenario.reference.on);
  EXPECT_TRUE(scenario.simulation.forward());
  EXPECT_EQ(scenario.simulation.step_s, 1e-3);
  EXPECT_EQ(scenario.start_window_s, 0.0);
  for (const MetricRow& row : MetricRows()) {
    const bool has = row.metric != Metric::kMotorUse;
    EXPECT_EQ(scenario.checks[row.metric].forward.has_value(), has) << row.key;
    EXPECT_EQ(scenario.checks[row.metric].inverse.has_value(), has) << row.key;
    EXPECT_EQ(scenario.checks[row.metric].reference.has_value(), has) << row.key;
  }
  EXPECT_EQ(scenario.snapshots.times_s, (std::vector<double>{0.0, 6.0}));
  EXPECT_EQ(scenario.expect.verdict, "agree");
}

TEST_F(LoadScenarioTest, LimitsAreSetPerModeForBothOrSwitchedOff) {
  const ScenarioResult result =
      Load(Complete("checks:\n"
                    "  force_nrmse: {forward: 1e-7}\n"
                    "  force_max: 1e-3\n"
                    "  reference_force_nrmse: 1e-11\n"
                    "  pose_m: null\n"
                    "  reaction_nrmse: off\n"
                    "  start_window_s: 0.2\n"));
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const CheckLimits& checks = result.scenario->checks;
  EXPECT_EQ(checks[Metric::kForceNrmse].forward, 1e-7);
  EXPECT_EQ(checks[Metric::kForceNrmse].inverse, RowOf(Metric::kForceNrmse).limits.inverse);
  EXPECT_EQ(checks[Metric::kForceNrmse].reference, 1e-11);
  EXPECT_EQ(checks[Metric::kForceMax].forward, 1e-3);
  EXPECT_EQ(checks[Metric::kForceMax].inverse, 1e-3);
  EXPECT_FALSE(checks[Metric::kPoseM].forward);
  EXPECT_TRUE(checks[Metric::kPoseM].reference);
  EXPECT_FALSE(checks[Metric::kReaction].inverse);
  EXPECT_EQ(result.scenario->start_window_s, 0.2);
}

TEST_F(LoadScenarioTest, WitnessesHaveTheirOwnParameters) {
  const ScenarioResult result =
      Load(Complete("parameters: {m_p: 40000}\n"
                    "analytic: {model: full, as_printed: [E2], parameters: {m_1: 2*800}}\n"
                    "reference: {parameters: {L2: 4.7901}}\n"
                    "simulation:\n"
                    "  mode: inverse\n"
                    "  engine: stock\n"
                    "  parameters: {link_mass_scale: 1}\n"
                    "  extrapolate: {parameter: link_mass_scale, from: [1, 0.25]}\n"));
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const Scenario& scenario = *result.scenario;
  EXPECT_EQ(result.mechanism->ParameterValue("m_p"), 40000.0);
  EXPECT_EQ(scenario.analytic.parameters.at("m_1"), 1600.0);
  EXPECT_EQ(scenario.analytic.as_printed, std::vector<std::string>{"E2"});
  EXPECT_EQ(scenario.reference.parameters.at("L2"), 4.7901);
  EXPECT_FALSE(scenario.simulation.forward());
  EXPECT_TRUE(scenario.simulation.stock_engine);
  EXPECT_EQ(scenario.simulation.extrapolate->from[1], 0.25);
  EXPECT_EQ(Merge(scenario.parameters, {{"m_p", 1.0}}).at("m_p"), 1.0);
}

TEST_F(LoadScenarioTest, LoadsActAtAFrameWithAnOffset) {
  const ScenarioResult result = Load(Complete(
      "loads:\n"
      "  crane: {on: limb1.link1, at: [0, 0.5, 0], force: [0, {sine: {amplitude: 9, period_s: 2}}, "
      "-400], in: body}\n"
      "  wind: {on: platform_in_base, moment: [1, 2, 3]}\n"));
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const auto& loads = result.scenario->motion.loads;
  ASSERT_EQ(loads.size(), 2u);
  EXPECT_EQ(loads[0].body, result.mechanism->FindBody("limb1.link1"));
  EXPECT_EQ(loads[0].p_BoQ_B, Vec3(0, 0.5, 0));
  EXPECT_TRUE(loads[0].in_body_axes);
  EXPECT_DOUBLE_EQ(Evaluate(loads[0].force[1], 0.5).value, 9.0);
  EXPECT_EQ(loads[1].body, result.mechanism->FindBody("platform"));
  EXPECT_FALSE(loads[1].in_body_axes);
  EXPECT_DOUBLE_EQ(Evaluate(loads[1].moment[2], 0.5).value, 3.0);
}

TEST_F(LoadScenarioTest, APathRestsAtItsPointsAndGivesTheDuration) {
  const std::string text =
      "mechanism: stabilizing_platform\n"
      "motion:\n"
      "  sample_s: 0.01\n"
      "  commands: {roll: 0, pitch: 0, heave: 0, platform.roll: 0, platform.pitch: 0, "
      "platform.yaw: 0}\n"
      "  path:\n"
      "    outputs: [platform.x, platform.y, platform.z]\n"
      "    points_mm: [[0, 0, 3500], [0, 0, 3560], [240, 0, 3560], [240, 0, 3500]]\n"
      "    v_max: 0.75\n"
      "    a_max: 10\n";
  const ScenarioResult result = Load(text);
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const Motion& motion = result.scenario->motion;
  // Two strokes of 0.06 m and one of 0.24 m, ramp-cruise-ramp.
  EXPECT_NEAR(motion.duration_s, 0.800013994, 1e-9);
  const Profile& x = motion.commands[static_cast<size_t>(motion.FindCommand("platform.x"))].profile;
  EXPECT_NEAR(Evaluate(x, 0.186120972).rate, 0.0, 1e-6);
  EXPECT_NEAR(Evaluate(x, 0.4).rate, 0.75, 1e-12);
  EXPECT_NEAR(Evaluate(x, 0.7).value, 0.24, 1e-12);
  const ScenarioResult full = Load(text + "    law: full\n");
  ASSERT_TRUE(full.scenario) << full.diagnostics.Text();
  EXPECT_NEAR(full.scenario->motion.duration_s, 2 * 0.186120972 + 0.6, 1e-8);
}

TEST_F(LoadScenarioTest, HomeStandsForTheValueAtTheHomePose) {
  std::string text = Complete();
  text.replace(text.find("z_0 + 0.25"), 10, "[home, 0.1]");
  const ScenarioResult result = Load(text);
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  // The home pose of the platform is level at z_0.
  EXPECT_NEAR(Evaluate(result.scenario->motion.commands[3].profile, 0.0).value, 3.6, 1e-12);
  // Neutral drive length, from the closed form of a symmetric limb.
  EXPECT_NEAR(HomeValue(*result.mechanism, {Coordinate::Kind::kDrive, 3, 0}), 2.818013474642,
              1e-11);
}

TEST_F(LoadScenarioTest, SetReplacesAndAddsValues) {
  const ScenarioResult result =
      Load(Complete("simulation: {mode: forward}\n"), {{"simulation.step_s", "0.0005"},
                                                       {"simulation.mode", "inverse"},
                                                       {"parameters.m_p", "45000"},
                                                       {"motion.commands.platform.z", "3.6"},
                                                       {"checks.force_nrmse.inverse", "1e-12"}});
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  EXPECT_EQ(result.scenario->simulation.step_s, 0.0005);
  EXPECT_FALSE(result.scenario->simulation.forward());
  EXPECT_EQ(result.mechanism->ParameterValue("m_p"), 45000.0);
  EXPECT_DOUBLE_EQ(Evaluate(result.scenario->motion.commands[3].profile, 0.0).value, 3.6);
  EXPECT_EQ(result.scenario->checks[Metric::kForceNrmse].inverse, 1e-12);
}

TEST_F(LoadScenarioTest, AStepThatDoesNotDivideTheSamplesIsMadeToFitAloud) {
  const ScenarioResult stated = Load(Complete("simulation: {step_s: 0.003}\n"));
  ASSERT_TRUE(stated.scenario) << stated.diagnostics.Text();
  EXPECT_DOUBLE_EQ(stated.scenario->simulation.step_s, 0.0025);
  EXPECT_NE(stated.diagnostics.Text().find("16:22: warning: simulation.step_s = 0.003 does not "
                                           "divide motion.sample_s = 0.01: the step is 0.0025 s"),
            std::string::npos)
      << stated.diagnostics.Text();
  // The default step is not the user's choice.
  for (const auto& [sample_s, step_s] : {std::pair{"0.0005", 0.0005}, {"0.0125", 0.0125 / 13}}) {
    const ScenarioResult result = Load(Complete(), {{"motion.sample_s", sample_s}});
    ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
    EXPECT_DOUBLE_EQ(result.scenario->simulation.step_s, step_s);
    EXPECT_TRUE(result.diagnostics.empty()) << result.diagnostics.Text();
  }
}

TEST_F(LoadScenarioTest, ParametersMayBeGivenInDegreesAndMillimetres) {
  const auto theta_1 = [&](const std::vector<SetValue>& set, const std::string& text) {
    const ScenarioResult result = Load(Complete(text), set);
    EXPECT_TRUE(result.scenario) << result.diagnostics.Text();
    return result.mechanism ? result.mechanism->ParameterValue("theta_1") : kNan;
  };
  EXPECT_DOUBLE_EQ(theta_1({{"parameters.theta_1_deg", "121"}}, ""), 121 * std::numbers::pi / 180);
  EXPECT_DOUBLE_EQ(theta_1({}, "parameters: {theta_1_deg: 60 + 61}\n"),
                   121 * std::numbers::pi / 180);
  // An option replaces what the file gives in another unit, either way.
  EXPECT_DOUBLE_EQ(theta_1({{"parameters.theta_1", "2.1"}}, "parameters: {theta_1_deg: 119}\n"),
                   2.1);
  const ScenarioResult perturbed = Load(Complete("analytic: {parameters: {r_a_mm: 7400}}\n"));
  ASSERT_TRUE(perturbed.scenario) << perturbed.diagnostics.Text();
  EXPECT_EQ(perturbed.scenario->analytic.parameters, (Overrides{{"r_a", 7.4}}));
  EXPECT_NE(Messages(Complete("parameters: {theta_1: 2, theta_1_deg: 120}\n"))
                .find("theta_1 and theta_1_deg are both given"),
            std::string::npos);
  EXPECT_NE(Messages(Complete("parameters: {theta_9_deg: 120}\n")).find("no parameter"),
            std::string::npos);
}

TEST_F(LoadScenarioTest, AScenarioMayGiveGravity) {
  const ScenarioResult result = Load(Complete("gravity: [0, 0, -1.62]\n"));
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  EXPECT_EQ(result.mechanism->gravity_W, Vec3(0, 0, -1.62));
  EXPECT_EQ(*ModelOptions(*result.scenario).gravity_W, Vec3(0, 0, -1.62));
  const ScenarioResult weightless = Load(Complete(), {{"gravity", "[0, 0, 0]"}});
  ASSERT_TRUE(weightless.scenario) << weightless.diagnostics.Text();
  EXPECT_EQ(weightless.mechanism->gravity_W, Vec3::Zero());
  EXPECT_EQ(weightless.mechanism->up_W, Vec3::UnitZ());
  EXPECT_NE(Messages(Complete("gravity: 9.81\n")).find("gravity"), std::string::npos);
}

TEST_F(LoadScenarioTest, FindingsAboutSetValuesNameTheOption) {
  EXPECT_EQ(Messages(Complete(), {{"simulation.stp_s", "0.1"}}),
            "--set simulation.stp_s=0.1: error: simulation: unknown key 'stp_s'\n"
            "  hint: did you mean 'step_s'?\n");
  EXPECT_EQ(
      Messages(Complete(), {{"parameters.m_q", "1"}}),
      "--set parameters.m_q=1: error: models/stabilizing_platform/model.yaml has no parameter "
      "'m_q'\n  hint: did you mean 'm_1'?\n");
  EXPECT_EQ(Messages(Complete(), {{"motion", "{"}}),
            "--set motion={: error: the value is not YAML\n"
            "  hint: write --set key=value, e.g. --set simulation.step_s=0.002\n");
  EXPECT_NE(Messages(Complete(), {{"m_p", "4"}})
                .find("hint: a parameter of the model: --set parameters.m_p=4; known keys: kind"),
            std::string::npos);
  // Of a key that is too long to be shown whole, too.
  const std::string longest(500, 'm');
  EXPECT_NE(Messages(Complete(), {{longest, "4"}}).find("hint: a parameter of the model: --set"),
            std::string::npos);
}

TEST_F(LoadScenarioTest, FindingsAboutSetValuesHaveKeyAndValueAsData) {
  for (const SetValue& set : {SetValue{"m_p", "4"}, SetValue{"simulation.stp_s", "0.1"}}) {
    const ScenarioResult result = Load(Complete(), {set});
    ASSERT_EQ(result.diagnostics.findings().size(), 1u) << result.diagnostics.Text();
    const Finding& finding = result.diagnostics.findings()[0];
    EXPECT_EQ(finding.code, FindingCode::kUnknownKey);
    EXPECT_EQ(finding.subject, set.first);
    EXPECT_EQ(finding.set, set);
  }
  const ScenarioResult model = Load(Complete(), {{"parameters.m_q", "1"}});
  ASSERT_EQ(model.diagnostics.findings().size(), 1u) << model.diagnostics.Text();
  EXPECT_EQ(model.diagnostics.findings()[0].set, (SetValue{"parameters.m_q", "1"}));
  const ScenarioResult file = Load(Complete("chekcs: {}\n"));
  ASSERT_FALSE(file.diagnostics.empty());
  EXPECT_TRUE(file.diagnostics.findings()[0].set.first.empty());
}

TEST_F(LoadScenarioTest, PicturesForPapersAreRead) {
  const auto snapshots = [&](const std::string& text) {
    return Load(Complete(text)).scenario->snapshots;
  };
  const SnapshotSettings plain = snapshots("");
  EXPECT_EQ(plain.background, "");
  EXPECT_TRUE(plain.labels.empty());
  const SnapshotSettings all = snapshots(
      "snapshots: {background: transparent, labels: joints, scale_bar: true, ghosts: [1, 2], "
      "style: line_art, exploded: 1.3, camera: {projection: orthographic}}\n");
  EXPECT_EQ(all.background, "transparent");
  EXPECT_EQ(all.labels, (std::vector<std::string>{"joints"}));
  EXPECT_TRUE(all.scale_bar);
  EXPECT_EQ(all.ghost_times_s, (std::vector<double>{1.0, 2.0}));
  EXPECT_TRUE(all.line_art);
  EXPECT_EQ(all.exploded, 1.3);
  EXPECT_TRUE(all.camera.orthographic);
  EXPECT_EQ(snapshots("snapshots: {ghosts: 5, background: default}\n").ghost_count, 5);
}

TEST_F(LoadScenarioTest, AllFindingsComeAtOnceInTheOrderOfTheFile) {
  const std::string messages = Messages(
      "mechanism: stabilizing_platform\n"
      "parameters: {m_pp: 1}\n"
      "motion: {duration_s: 0, commands: {rol: 0}}\n"
      "simulation: {mode: backward}\n");
  const size_t duration = messages.find("3:22: error: motion.duration_s = 0");
  const size_t command = messages.find("3:36: error: motion.commands");
  const size_t mode = messages.find("4:20: error: simulation.mode");
  EXPECT_NE(messages.find("2:14: error"), std::string::npos) << messages;
  EXPECT_LT(duration, command);
  EXPECT_LT(command, mode);
  EXPECT_NE(mode, std::string::npos) << messages;
}

TEST_F(LoadScenarioTest, DamagedFilesGiveFindingsAndNeverAScenarioThatIsIncomplete) {
  const std::string whole = Complete("loads: {w: {on: platform, force: [0, 0, 1]}}\n");
  std::mt19937_64 random(20260101);
  for (int k = 0; k < 60; ++k) {
    std::string text = whole;
    const size_t at = random() % text.size();
    if (k % 3 == 0) text.resize(at);
    if (k % 3 == 1) text.erase(at, 1 + random() % 5);
    if (k % 3 == 2) text[at] = static_cast<char>(random() % 128);
    const ScenarioResult result = Load(text);
    EXPECT_EQ(result.scenario.has_value(), !result.diagnostics.has_errors()) << text;
    if (!result.scenario) continue;
    EXPECT_EQ(result.scenario->motion.commands.size(), 9u) << text;
  }
}

TEST_F(LoadScenarioTest, AMissingFileIsAFinding) {
  EXPECT_EQ(LoadScenario("scenarios/none.yaml").diagnostics.Text(),
            "scenarios/none.yaml: error: the file cannot be read\n"
            "  hint: check the name; paths are relative to the current folder\n");
}

TEST_F(LoadScenarioTest, TheHeadIsReadFromBrokenFilesToo) {
  const auto folder = std::filesystem::temp_directory_path() / "mbv_scenario_head";
  std::filesystem::create_directories(folder);
  const std::string file = folder / "broken.yaml";
  std::ofstream(file) << "# expect: {exit_code: 2, mentions: \"YAML syntax\"}\nmechanism: [\n";
  const ScenarioHead head = ReadScenarioHead(file);
  std::filesystem::remove_all(folder);
  EXPECT_TRUE(head.is_scenario);
  EXPECT_EQ(head.expect.exit_code, 2);
  EXPECT_EQ(head.expect.verdict, "not_run");
  EXPECT_EQ(head.expect.mentions, "YAML syntax");
}

TEST_F(LoadScenarioTest, CasesAreNamedByTheirPathBelowTheModelsFolder) {
  const ScenarioResult result =
      LoadScenario("scenarios/stabilizing_platform/must_fail/analytic_mass.yaml");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  EXPECT_EQ(result.scenario->name, "must_fail/analytic_mass");
  EXPECT_EQ(result.scenario->expect.verdict, "disagree");
  EXPECT_EQ(result.scenario->expect.exit_code, 1);
}

}  // namespace
}  // namespace mbv
