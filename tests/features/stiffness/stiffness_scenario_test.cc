// Stiffness scenarios are read completely, or everything that is wrong with them is said.
#include "features/stiffness/stiffness_scenario.h"
#include "tests/support/document_text.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

namespace mbv {
namespace {

class StiffnessScenarioText : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::current_path(kSourceDir); }

  static StiffnessScenarioResult Load(const std::string& text,
                                      const ScenarioOptions& options = {}) {
    return LoadStiffnessScenarioText(text, "scenarios/scara_robot/s.yaml", options);
  }
  static std::string FindingsOf(const std::string& text) {
    const StiffnessScenarioResult result = Load(text);
    EXPECT_FALSE(result.scenario.has_value());
    return result.diagnostics.Text();
  }
};

constexpr const char* kMinimal = "kind: stiffness\nmechanism: scara_robot\n";
constexpr const char* kFull = R"(kind: stiffness
mechanism: scara_robot
description: a check
parameters: {K_act: 1000}
pose: {platform.x_mm: -50, platform.y: -0.05, platform.z: -0.15, platform.yaw_deg: 10}
output: platform
analytic: {model: corrected, parameters: {d: 0.03}}
reference: {parameters: {E: 200e9}}
simulation: {force_N: 2, moment_Nm: 0.1, parameters: {E: 190e9}}
compare_printed: true
loads: [{force: [1, 2, 3]}, {moment: [0, 0, 4], force: [5, 0, 0]}]
checks: {stiffness_entry: 1.0e-3, reference_stiffness_entry: 1.0e-8, rotation_axis: null}
expect: {verdict: disagree, mentions: differs}
)";

TEST_F(StiffnessScenarioText, ANameWithASemicolonStaysWhole) {
  const test::TestFolder folder("semicolon");
  folder.Write("models/a; b/model.yaml", "");
  const StiffnessScenarioResult result =
      LoadStiffnessScenarioText("kind: stiffness\nmechanism: \"a; b\"\n", folder.PathOf("s.yaml"));
  ASSERT_FALSE(result.diagnostics.empty());
  EXPECT_EQ(result.diagnostics.findings()[0].message,
            "mechanism = 'a; b': a; b has no elastic.yaml with its beams and servos");
}

TEST_F(StiffnessScenarioText, EveryKeyIsRead) {
  const StiffnessScenarioResult result = Load(kFull);
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const StiffnessScenario& s = *result.scenario;
  EXPECT_EQ(s.name, "s");
  EXPECT_NE(s.model_file.find("models/scara_robot/elastic.yaml"), std::string::npos);
  EXPECT_EQ(result.mechanism->ParameterValue("K_act"), 1000);
  EXPECT_DOUBLE_EQ(s.pose.at("platform.x"), -0.05);
  EXPECT_NEAR(s.pose.at("platform.yaw"), 0.17453292519943295, 1e-15);
  EXPECT_EQ(s.output, "platform");
  EXPECT_EQ(s.analytic.parameters.at("d"), 0.03);
  EXPECT_EQ(s.reference.parameters.at("E"), 200e9);
  EXPECT_EQ(s.simulation.parameters.at("E"), 190e9);
  EXPECT_EQ(s.force_N, 2);
  EXPECT_EQ(s.moment_Nm, 0.1);
  EXPECT_TRUE(s.compare_printed);
  ASSERT_EQ(s.loads.size(), 2u);
  EXPECT_EQ(s.loads[1], (Vec6() << 0, 0, 4, 5, 0, 0).finished());
  EXPECT_EQ(s.checks[Metric::kStiffnessEntry].forward, 1e-3);
  EXPECT_EQ(s.checks[Metric::kStiffnessEntry].reference, 1e-8);
  EXPECT_FALSE(s.checks[Metric::kRotationAxis].forward);
  EXPECT_EQ(s.expect.verdict, "disagree");
}

TEST_F(StiffnessScenarioText, WhatIsLeftOutHasDefaults) {
  const StiffnessScenarioResult result = Load(kMinimal);
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const StiffnessScenario& s = *result.scenario;
  EXPECT_TRUE(s.pose.empty());
  EXPECT_TRUE(s.analytic.on && s.reference.on && s.simulation.on);
  EXPECT_FALSE(s.compare_printed);
  EXPECT_TRUE(s.loads.empty());
  EXPECT_EQ(s.expect.verdict, "agree");
}

TEST_F(StiffnessScenarioText, FiftyLoadsFollowThePublishedGenerator) {
  const StiffnessScenarioResult result =
      Load(std::string(kMinimal) +
           "loads: {random: {count: 50, seed: 20250201, force_max: 1000, moment_max: 1}}\n");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const std::vector<Vec6>& loads = result.scenario->loads;
  ASSERT_EQ(loads.size(), 50u);
  // x ← 6364136223846793005 x + 1442695040888963407 mod 2⁶⁴ from x = 20250201 by a calculator of
  // any length; u = (x >> 11)/2⁵³; Fx, Fy, Fz = 1000 u, then Mx, My, Mz = u.
  const double first[] = {0.245263, 0.700674, 0.332428, 872.199362, 873.529244, 700.172153};
  for (int c = 0; c < 6; ++c) EXPECT_NEAR(loads[0][c], first[c], 5.1e-7) << c;
  for (const Vec6& load : loads) {
    EXPECT_GE(load.minCoeff(), 0.0);
    EXPECT_LT(load.head<3>().maxCoeff(), 1.0);
    EXPECT_LT(load.tail<3>().maxCoeff(), 1000.0);
  }
  EXPECT_EQ(DrawLoads({}), loads);
  EXPECT_NE(DrawLoads({.seed = 20250202})[0], loads[0]);
}

TEST_F(StiffnessScenarioText, ParametersOfTheModelMayStandInThePose) {
  const StiffnessScenarioResult result = LoadStiffnessScenarioText(
      "kind: stiffness\nmechanism: cabin_robot\n"
      "pose: {d1: 0.5, platform.x: 0, platform.y: 0.36, platform.yaw: 0, th3_deg: 90, th4: 0, "
      "d5: -0.3, th6: 0}\n",
      "scenarios/cabin_robot/s.yaml");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  EXPECT_EQ(result.mechanism->ParameterValue("d5"), -0.3);
  EXPECT_FALSE(result.scenario->pose.contains("d5"));
}

TEST_F(StiffnessScenarioText, AllThatIsWrongIsReportedAtOnceWithItsPlace) {
  const std::string text = FindingsOf(R"(kind: stiffness
mechanism: scara_robot
pose: {platform.x: -0.05, platform.y: -0.05, platform.hight: -0.15, platform.yaw: 0.2}
output: plattform
simulation: {parameters: {K_akt: 1000}, force_N: -1}
analytic: {as_printed: [E3]}
loads: {random: {count: -3, seed: 1.5, force_max: -1}}
checks: {stiffnes_entry: 1.0e-4, symmetry: -1}
colour: red
)");
  for (const char* part :
       {"s.yaml:3:46: error: pose: scara_robot has no coordinate or parameter 'platform.hight'",
        "s.yaml:4:9: error: output", "did you mean 'platform'", "has no parameter 'K_akt'",
        "did you mean 'K_act'", "simulation.force_N = -1", "stiffness models have no errata",
        "loads.random.count = -3 violates 1 <= count <= 10000", "loads.random.seed",
        "loads.random.force_max = -1", "unknown key 'stiffnes_entry'",
        "did you mean 'stiffness_entry'", "checks.symmetry = -1", "unknown key 'colour'"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
}

TEST_F(StiffnessScenarioText, TheNumberOfCoordinatesIsThatOfTheDegreesOfFreedom) {
  const std::string text = FindingsOf(std::string(kMinimal) + "pose: {platform.x: 0}\n");
  EXPECT_NE(text.find("pose gives 1 coordinates, but scara_robot has 4 degrees of freedom"),
            std::string::npos)
      << text;
}

TEST_F(StiffnessScenarioText, RigidAndUnknownModelsAreRefused) {
  EXPECT_NE(FindingsOf("kind: stiffness\nmechanism: spr_tripod\n").find("has no elastic.yaml"),
            std::string::npos);
  EXPECT_NE(FindingsOf("kind: stiffness\nmechanism: scara_robo\n").find("'scara_robot'"),
            std::string::npos);
  EXPECT_NE(FindingsOf("kind: stiffness\nmechanism: ../../models/spr_tripod/model.yaml\n")
                .find("is rigid"),
            std::string::npos);
}

TEST_F(StiffnessScenarioText, NothingToComputeIsNotAScenario) {
  EXPECT_NE(FindingsOf(std::string(kMinimal) + "analytic: none\nreference: off\nsimulation: off\n")
                .find("all off"),
            std::string::npos);
}

TEST_F(StiffnessScenarioText, EmptyLoadsAreNoLoads) {
  EXPECT_NE(FindingsOf(std::string(kMinimal) + "loads: [{force: [0, 0, 0]}]\n")
                .find("loads[0] is not a load"),
            std::string::npos);
  EXPECT_NE(FindingsOf(std::string(kMinimal) + "loads: {random: {force_max: 0, moment_max: 0}}\n")
                .find("is not a load"),
            std::string::npos);
}

TEST_F(StiffnessScenarioText, TheDocumentsExampleLoadsAndItsTableHoldsTheDefaults) {
  std::ifstream stream("docs/explanation/stiffness.md");
  std::stringstream read;
  read << stream.rdbuf();
  const std::string document = read.str();
  const size_t start = document.find("```yaml\n") + 8;
  const std::string example = document.substr(start, document.find("```", start) - start);
  const StiffnessScenarioResult result =
      LoadStiffnessScenarioText(example, "scenarios/cabin_robot/s.yaml");
  EXPECT_TRUE(result.scenario) << result.diagnostics.Text();
  for (const MetricRow& row : StiffnessMetricRows()) {
    std::string line = fmt::format("| `{}` | {} | {:.0e} | {:.0e} |\n", row.key, row.title,
                                   *row.limits.forward, *row.limits.reference);
    const std::string plain = test::AsPlainText(line);
    EXPECT_NE(document.find(plain), std::string::npos) << plain;
  }
}

}  // namespace
}  // namespace mbv
