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

// What acts along one coordinate of a universal joint has no power about its other axis, also where
// that is inclined: then it is not a moment about its own axis.
TEST_F(OwnMechanism, ReactionsOfUniversalJointsWithInclinedAxesAgree) {
  const std::string drive = "joint: U, coordinate: ";
  const std::map<std::string, std::string> models = {
      {"driven", "drives: {a: {kind: joint, " + drive + "0}, b: {kind: joint, " + drive + "1}}\n"},
      {"sprung", "drives: {a: {kind: joint, " + drive + "0}, b: {kind: joint, " + drive + "1}}\n" +
                     "elements:\n  s: {kind: spring, " + drive + "1, stiffness: 4}\n" +
                     "  r: {kind: friction, " + drive + "0, coulomb: 2}\n"},
      {"geared", "drives: {a: {kind: joint, " + drive +
                     "0}}\ncouplings: {g: {joint: U, coordinate: " +
                     "1, follows: U, follows_coordinate: 0, ratio: 0.7}}\n"},
      {"reversed",
       "drives: {a: {kind: joint, " + drive + "0}, b: {kind: joint, " + drive + "1}}\n"}};
  for (const auto& [name, acting] : models) {
    const bool reversed = name == "reversed";
    std::ofstream(mbverify.folder() / (name + ".yaml"))
        << "name: " << name << "\nbodies: {link: {mass: 1, com: [0.1, 0.05, 0.2], inertia: [0.02, "
        << "0.03, 0.01]}}\njoints: {U: {kind: universal, "
        << (reversed ? "parent: link, child: world" : "parent: world, child: link")
        << ", axis: y, axis2: [1, 0.4, 0.2]}}\noutputs: {link: link}\n"
        << acting;
    const bool two = acting.find("b: {kind") != std::string::npos;
    std::ofstream(mbverify.folder() / "turn.yaml")
        << "mechanism: ./" << name << ".yaml\nanalytic: none\nsnapshots: {times_s: []}\nmotion:\n"
        << "  duration_s: 1\n  commands:\n    a: {poly345: {duration_s: 1, delta_deg: 60}}\n"
        << (two ? "    b: {poly345: {duration_s: 1, delta_deg: 40}}\n" : "");
    for (const char* mode : {"forward", "inverse"}) {
      const ProgramResult result = mbverify("run " + (mbverify.folder() / "turn.yaml").string() +
                                            " --out " + mbverify.Out() + " --mode " + mode);
      EXPECT_EQ(result.exit_code, 0) << name << ", " << mode << '\n' << result.out << result.err;
      const std::string path = mbverify.Out() + "/" + name + "/turn/summary.json";
      EXPECT_TRUE(
          nlohmann::json::parse(ReadAll(path))["metrics"]["simulated_vs_reference"].contains(
              "reaction_nrmse_own"))
          << name;
    }
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
