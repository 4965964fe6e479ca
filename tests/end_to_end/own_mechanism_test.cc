// A user's own mechanism: a model file and a scenario in some folder, no C++ and no closed form.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

constexpr const char* kModel = R"(name: four_bar
parameters: {crank: 0.2, ground: 0.5}
gravity: [0, -9.81, 0]
world: {frames: {A: [0, 0, 0], D: [ground, 0, 0]}}
bodies:
  crank: {mass: 2, com: [crank/2, 0, 0], inertia: [0.001, 0.008, 0.008], frames: {end: [crank, 0, 0]}}
  coupler: {mass: 1, com: [ground/2, 0, 0], inertia: [0.001, 0.02, 0.02], frames: {end: [ground, 0, 0]}}
  rocker: {mass: 2, com: [0.15, 0, 0], inertia: [0.001, 0.015, 0.015], frames: {end: [0.3, 0, 0]}}
joints:
  A: {kind: revolute, parent: world.A, child: crank, axis: z, guess_deg: 60}
  B: {kind: revolute, parent: crank.end, child: coupler, axis: z, guess_deg: -40}
  C: {kind: revolute, parent: rocker.end, child: coupler.end, axis: z, transmits: force}
  D: {kind: revolute, parent: world.D, child: rocker, axis: z, guess_deg: 70}
drives: {motor: {kind: joint, joint: A}}
outputs: {tool: coupler.end}
)";
constexpr const char* kOwnScenario = R"(mechanism: ./four_bar.yaml
motion:
  duration_s: 1
  commands: {motor: [home, {sine: {amplitude_deg: 20, period_s: 1}}]}
simulation: {mode: forward}
snapshots: {times_s: []}
)";

class OwnMechanism : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(mbverify.folder() / "four_bar.yaml") << kModel;
    std::ofstream(mbverify.folder() / "swing.yaml") << kOwnScenario;
  }
  ProgramResult Run(const std::string& more) const {
    return mbverify("run " + (mbverify.folder() / "swing.yaml").string() + " --out " +
                    mbverify.Out() + " " + more);
  }
  [[nodiscard]] nlohmann::json Summary() const {
    return nlohmann::json::parse(ReadAll(mbverify.Out() + "/four_bar/swing/summary.json"));
  }

  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(OwnMechanism, ReferenceAndSimulationAgreeInBothModes) {
  for (const char* mode : {"--mode forward", "--mode inverse"}) {
    const ProgramResult result = Run(mode);
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_NE(result.out.find("reference drive motion"), std::string::npos) << result.out;
    const auto summary = Summary();
    EXPECT_TRUE(summary["metrics"].contains("simulated_vs_reference"));
    EXPECT_FALSE(summary["metrics"].contains("simulated_vs_analytic"));
    EXPECT_EQ(summary["not_compared"][0]["why"],
              "analytic: there are no closed-form equations for four_bar");
  }
}

TEST_F(OwnMechanism, AWrongMassOnOneSideIsSeenButNotAttributed) {
  const ProgramResult result = Run("--mode inverse --set simulation.parameters.crank=0.2002");
  EXPECT_EQ(result.exit_code, 1) << result.out;
  EXPECT_EQ(Summary()["attribution"]["odd_one_out"], "");
}

TEST_F(OwnMechanism, WithoutAnythingThatGivesTheDriveMotionItIsBadInput) {
  const ProgramResult result = Run("--set reference=off");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("set reference: on"), std::string::npos) << result.err;
}

}  // namespace
}  // namespace mbv
