// Models outside what a closed form covers: the analytic witness is not applicable and says why,
// the other two go on.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "analytic/closed_form.h"
#include "features/run/run_scenario.h"
#include "features/stiffness/stiffness_report.h"
#include "features/workspace/workspace.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string ReadShipped(const std::string& file) {
  std::ifstream stream(SourcePath("/" + file));
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

void Replace(const std::string& from, const std::string& to, std::string* text) {
  ASSERT_NE(text->find(from), std::string::npos) << from;
  text->replace(text->find(from), from.size(), to);
}

// A copy of a shipped model beside a scenario, in the test's own folder.
class Copy {
 public:
  explicit Copy(const std::string& name)
      : folder_(fs::path(testing::TempDir()) / "mbv_not_applicable" / name) {
    fs::create_directories(folder_);
  }
  std::string Model(const std::string& text) const { return Write("model.yaml", text); }
  [[nodiscard]] std::string Scenario(std::string text, const std::string& mechanism) const {
    Replace("mechanism: " + mechanism, "mechanism: ./model.yaml", &text);
    return Write("scenario.yaml", text);
  }

 private:
  std::string Write(const char* name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }
  fs::path folder_;
};

struct Outcome {
  int exit_code = 4;
  std::string reason;  // why analytic did not run; "" if it did
  std::string findings;
  bool others_ran = false;
};

Outcome RunFile(const std::string& scenario, std::vector<SetValue> set = {}) {
  RunOptions options;
  options.pictures = false;
  set.emplace_back("simulation.mode", "inverse");
  options.scenario.set = set;
  const RunOutcome run = RunScenario(scenario, options);
  Outcome outcome{.exit_code = run.exit_code, .reason = {}, .findings = run.diagnostics.Text()};
  if (!run.report) return outcome;
  outcome.others_ran = true;
  for (const WitnessRecord& record : run.report->witnesses) {
    if (record.name == "analytic") {
      if (!record.summary.ok()) outcome.reason = record.summary.message;
    } else {
      outcome.others_ran = outcome.others_ran && record.summary.ok();
    }
  }
  return outcome;
}

void ExpectNotApplicable(const Outcome& outcome, const std::string& fact, const std::string& why) {
  EXPECT_EQ(outcome.exit_code, 0) << outcome.findings;  // the other two agree
  EXPECT_TRUE(outcome.others_ran);
  EXPECT_NE(outcome.reason.find(fact), std::string::npos) << outcome.reason;
  EXPECT_NE(outcome.reason.find(why), std::string::npos) << outcome.reason;
  EXPECT_NE(outcome.findings.find("warning: analytic is not applicable: " + fact),
            std::string::npos)
      << outcome.findings;
}

TEST(WarnNotApplicable, ACentreOfMassBesideTheLink) {
  const Copy copy("off_axis");
  std::string model = ReadShipped("models/stabilizing_platform/model.yaml");
  Replace("com: [c_1_x, c_1*L1, c_1_z]", "com: [0.4, c_1*L1, c_1_z]", &model);
  const std::string file = copy.Model(model);
  const std::string scenario = copy.Scenario(
      ReadShipped("scenarios/stabilizing_platform/sea_state.yaml"), "stabilizing_platform");
  ExpectNotApplicable(RunFile(scenario, {{"motion.sample_s", "0.1"}}),
                      "body limb1.link1: centre of mass x is 0.4 m",
                      "the closed form of the stabilizing platform takes 0 m");
  // `check` says so for the model alone, too.
  const Diagnostics check = CheckFile(file);
  EXPECT_FALSE(check.has_errors());
  EXPECT_NE(check.Text().find(
                "the closed form will not be applicable: body limb3.link1: centre of mass x"),
            std::string::npos)
      << check.Text();
  EXPECT_EQ(
      CheckFile(SourcePath("/models/stabilizing_platform/model.yaml")).Text().find("applicable"),
      std::string::npos);
}

TEST(WarnNotApplicable, AMissingFractionIsNotTakenAsOneHalf) {
  const Copy copy("no_fraction");
  std::string model = ReadShipped("models/stabilizing_platform/model.yaml");
  const size_t line = model.find("  c_1: {");
  model.erase(line, model.find('\n', line) - line + 1);
  Replace("c_1*L1", "0.4*L1", &model);
  Replace("c_1*L1", "0.4*L1", &model);
  copy.Model(model);
  const std::string scenario = copy.Scenario(
      ReadShipped("scenarios/stabilizing_platform/sea_state.yaml"), "stabilizing_platform");
  ExpectNotApplicable(RunFile(scenario, {{"motion.sample_s", "0.1"}}), "parameter c_1 is missing",
                      "reads it by this name");
}

TEST(WarnNotApplicable, ASpringOnTheCabinRobotAndTheTripod) {
  for (const auto& [name, from, to] : {std::tuple{"cabin_robot", "platform.B", "sliderD"},
                                       std::tuple{"spr_tripod", "world", "platform.O"}}) {
    const Copy copy(std::string("spring_") + name);
    copy.Model(ReadShipped(std::string("models/") + name + "/model.yaml") +
               "\nsprings:\n  buffer: {from: " + from + ", to: " + to +
               ", stiffness: 1000, damping: 20, free_length: 0.1}\n");
    const std::string file = std::string("scenarios/") + name + "/static.yaml";
    ExpectNotApplicable(RunFile(copy.Scenario(ReadShipped(file), name)),
                        "spring-damper buffer of 1000 N/m and 20 N s/m", "has no springs");
  }
}

TEST(WarnNotApplicable, ALoadOnABodyThatTheEquationsDoNotKnow) {
  const Copy copy("load");
  std::string model = ReadShipped("models/cabin_robot/model.yaml");
  Replace("bodies:\n", "bodies:\n  camera: {}\n", &model);
  Replace("\njoints:\n",
          "\njoints:\n  camera_mount: {kind: fixed, parent: platform, child: camera}\n", &model);
  copy.Model(model);
  const std::string scenario =
      copy.Scenario(ReadShipped("scenarios/cabin_robot/static.yaml") +
                        "\nloads: {cable: {on: camera, force: [10, -20, 5]}}\n",
                    "cabin_robot");
  ExpectNotApplicable(RunFile(scenario), "load cable acts on camera", "takes loads on carriage");
  // Without the load, a body without mass changes nothing.
  const std::string bare =
      copy.Scenario(ReadShipped("scenarios/cabin_robot/static.yaml"), "cabin_robot");
  EXPECT_EQ(RunFile(bare).reason, "");
}

TEST(WarnNotApplicable, AnotherMechanismOfTheSameName) {
  // A four-bar by the name of each mechanism that has equations.
  for (const ClosedFormRow& row : ClosedForms()) {
    const Copy copy("named_" + row.mechanism);
    std::string model = ReadShipped("models/four_bar/model.yaml");
    Replace("name: four_bar", "name: " + row.mechanism, &model);
    copy.Model(model);
    std::string turn = ReadShipped("scenarios/four_bar/turn_inverse.yaml");
    Replace("analytic: none\n", "", &turn);
    const Outcome outcome = RunFile(copy.Scenario(turn, "four_bar"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.findings;
    EXPECT_NE(outcome.reason.find("is missing"), std::string::npos) << outcome.reason;
  }
}

TEST(WarnNotApplicable, TheWorkspaceOfAnotherMechanismIsRefused) {
  LoadResult loaded = LoadModel(SourcePath("/models/scara_robot/model.yaml"));
  ASSERT_TRUE(loaded.mechanism);
  Mechanism perturbed = *loaded.mechanism;
  perturbed.joints[size_t(perturbed.FindJoint("limb3.motor"))].X_PF.translation().x() += 0.01;
  const WorkspaceOutcome outcome = ComputeWorkspace(perturbed, false);
  EXPECT_TRUE(outcome.diagnostics.has_errors());
  EXPECT_NE(outcome.diagnostics.Text().find("joint limb3.motor: centre on world, x is -0.09 m"),
            std::string::npos)
      << outcome.diagnostics.Text();
  EXPECT_TRUE(outcome.files.empty());
  // Masses do not matter.
  Mechanism heavy = *loaded.mechanism;
  heavy.bodies[1].mass *= 2;
  EXPECT_FALSE(ComputeWorkspace(heavy, false).diagnostics.has_errors());
}

// The elastic SCARA robot, away from the shipped models.
std::string ElasticModel() {
  std::string model = ReadShipped("models/scara_robot/elastic.yaml");
  Replace("parameters_from: model.yaml",
          "parameters_from: \"" + SourcePath("/models/scara_robot/model.yaml") + "\"", &model);
  return model;
}
RunOutcome StiffnessOf(const Copy& copy, const std::string& model) {
  copy.Model(model);
  const std::string scenario =
      copy.Scenario(ReadShipped("scenarios/scara_robot/stiffness.yaml"), "scara_robot");
  RunOptions options;
  options.pictures = false;
  RunOutcome outcome = RunScenario(scenario, options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  return outcome;
}

TEST(WarnNotApplicable, AnElasticModelWithAnotherBeam) {
  std::string model = ElasticModel();
  Replace("beams: {bar: {from: D, to: B, section: rod,",
          "beams: {bar: {from: D, to: B, section: stout,", &model);
  Replace("sections: {rod:", "sections: {stout: {round: {diameter: 0.012}}, rod:", &model);
  const Copy copy("beam");
  const RunOutcome outcome = StiffnessOf(copy, model);
  EXPECT_NE(outcome.diagnostics.Text().find(
                "analytic is not applicable: beam limb1.bar: area is 0.000113097"),
            std::string::npos)
      << outcome.diagnostics.Text();
  // A caveat of the verdict, in JSON and on the line of -q.
  ASSERT_TRUE(outcome.other);
  const std::vector<Caveat>& caveats =
      dynamic_cast<const ShownStiffness&>(*outcome.other).report().comparison.caveats;
  ASSERT_EQ(caveats.size(), 1u);
  EXPECT_EQ(caveats[0].kind, CaveatKind::kWitnessMissing);
  EXPECT_EQ(caveats[0].gap, WitnessGap::kNotApplicable);
  const std::string text = "without the witness analytic, which nothing was compared with: ";
  EXPECT_TRUE(caveats[0].text.starts_with(text)) << caveats[0].text;
  EXPECT_NE(VerdictLine(outcome.other->View(), {}).find("; caveat: " + text), std::string::npos);
  const auto json = nlohmann::json::parse(outcome.other->Json());
  EXPECT_EQ(json["caveats"][0]["kind"], "witness_missing");
  EXPECT_EQ(json["caveats"][0]["cause"], "not_applicable");
  EXPECT_TRUE(json["caveats"][0]["text"].get<std::string>().starts_with(text));
}

// Of a robot's file that has more than the model, and of a closed form that is there.
TEST(WarnNotApplicable, AStiffnessOfAModelThatLeavesSomethingOutHasACaveat) {
  for (const bool whole : {true, false}) {
    const Copy copy(whole ? "whole" : "left_out");
    const RunOutcome outcome = StiffnessOf(
        copy, ElasticModel() + (whole ? "" : "\nleft_out: [a spring acts on the joint]\n"));
    ASSERT_TRUE(outcome.other);
    const auto json = nlohmann::json::parse(outcome.other->Json());
    ASSERT_EQ(json["caveats"].size(), whole ? 0u : 1u) << json["caveats"];
    if (whole) continue;
    EXPECT_EQ(json["caveats"][0]["kind"], "left_out");
    EXPECT_NE(VerdictLine(outcome.other->View(), {})
                  .find("; caveat: not the whole robot: a spring acts on the joint"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace mbv
