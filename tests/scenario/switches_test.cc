// Signals that jump and elements that are switched, of scenario files.
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/scenario/load_scenario_fixture.h"

namespace mbv {
namespace {

class SwitchesTest : public LoadScenarioTest {
 protected:
  static ScenarioResult Winch(const std::string& more) {
    return LoadScenarioText(
        "mechanism: winch\nmotion: {duration_s: 2, sample_s: 0.01}\nanalytic: none\n" + more,
        "scenarios/winch/t.yaml");
  }
  static void Says(const std::string& more, const std::string& words) {
    const std::string text = Winch(more).diagnostics.Text();
    EXPECT_NE(text.find(words), std::string::npos) << more << "\n" << text;
  }
};

TEST_F(SwitchesTest, ForcesJumpWhereTheyAreStated) {
  const ScenarioResult result = Winch(
      "forces:\n  motor: [{step: {at_s: 0.5, height: 2}},"
      " {pulse: {start_s: 1, duration_s: 0.1, height: -3, period_s: 0.3, count: 2}},"
      " {ramp: {rate: 4, start_s: 0.2, duration_s: 0.25}}]\n"
      "switches: {brake: {step: {at_s: 0.7, height: 1}}}\n");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const Motion& motion = result.scenario->motion;
  const std::vector<double> jumps = JumpTimes(motion), stated = {0.5, 0.7, 1.0, 1.1, 1.3, 1.4};
  ASSERT_EQ(jumps.size(), stated.size());
  for (size_t i = 0; i < jumps.size(); ++i) EXPECT_DOUBLE_EQ(jumps[i], stated[i]);
  const Profile& force = motion.forces[0].force;
  EXPECT_DOUBLE_EQ(Evaluate(force, 0.3).value, 0.4);  // ramp
  EXPECT_DOUBLE_EQ(Evaluate(force, 0.49).value, 1.0);
  EXPECT_DOUBLE_EQ(Evaluate(force, 0.5).value, 3.0);  // what follows
  EXPECT_DOUBLE_EQ(Evaluate(force, BeforeJump(0.5)).value, 1.0);
  EXPECT_DOUBLE_EQ(Evaluate(force, 1.05).value, 0.0);
  EXPECT_DOUBLE_EQ(Evaluate(force, 1.2).value, 3.0);
  EXPECT_DOUBLE_EQ(Evaluate(force, 1.35).value, 0.0);
  EXPECT_EQ(SwitchedOff(motion, 0.0, 0.69).size(), 1u);
  EXPECT_TRUE(SwitchedOff(motion, 0.7, 0.8).empty());
  UntilJump until(motion);
  until.StartFrom(0.5);
  EXPECT_EQ(until(0.6), 0.6);
  EXPECT_LT(until(0.7), 0.7);
  EXPECT_TRUE(until.IsJump(0.7));
  EXPECT_FALSE(until.IsJump(0.71));
}

TEST_F(SwitchesTest, WhatMeansNothingIsAFinding) {
  const std::string free = "forces: {motor: 0}\n";
  Says(free + "switches: {clutch: 1}\n", "has no element and no body 'clutch'");
  Says(free + "switches: {drum: 1}\n", "only where another body carries it");
  Says(free + "switches: {buffer: 1}\n", "is not switched");
  Says(free + "switches: {brake: [1, {step: {at_s: 1, height: -2}}]}\n", "violates share >= 0");
  Says("forces: {motor: {step: {height: 1}}}\n", "at_s");
  Says("forces: {motor: {pulse: {duration_s: 0.2, height: 1, count: 2}}}\n", "period_s");
  Says("forces: {motor: {pulse: {duration_s: 0.2, height: 1, period_s: 1}}}\n", "count as well");
  Says("forces: {motor: {pulse: {duration_s: 0.2, height: 1, period_s: 0.1, count: 2}}}\n",
       "period_s > duration_s");
  // A motion cannot jump.
  const std::string text = LoadScenarioText(
                               "mechanism: winch\nmotion: {duration_s: 2, commands: {motor: "
                               "{step: {at_s: 1, height: 2}}}}\nanalytic: none\n",
                               "scenarios/winch/t.yaml")
                               .diagnostics.Text();
  EXPECT_NE(text.find("step"), std::string::npos) << text;
}

}  // namespace
}  // namespace mbv
