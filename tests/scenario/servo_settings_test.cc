// Modes in which forces or servos move the drives: gains, and what does not go with them.
#include <gtest/gtest.h>

#include <filesystem>

#include "scenario/load_scenario.h"
#include "scenario/section_readers.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

ScenarioResult LoadWith(const std::string& simulation, const std::string& more = "") {
  std::filesystem::current_path(kSourceDir);
  return LoadScenarioText(
      "mechanism: spr_tripod\n"
      "motion: {duration_s: 1, sample_s: 0.01, commands: {leg1: 0.6, leg2: 0.6, leg3: 0.6}}\n"
      "simulation: " +
          simulation + "\n" + more,
      "scenarios/spr_tripod/t.yaml");
}

std::string Messages(const std::string& simulation, const std::string& more = "") {
  return LoadWith(simulation, more).diagnostics.Text();
}

bool Says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(ServoSettings, GainsAreOneNumberOrOnePerDrive) {
  const ScenarioResult one = LoadWith("{mode: servo, kp: 2e5, kv: 100*m_rod, feedforward: forces}");
  ASSERT_TRUE(one.scenario) << one.diagnostics.Text();
  const SimulationSettings& settings = one.scenario->simulation;
  EXPECT_TRUE(settings.forward());
  EXPECT_EQ(settings.mode, DriveMode::kServo);
  EXPECT_EQ(settings.servo.kp.Of("leg2"), 2e5);
  EXPECT_EQ(settings.servo.kv.Of("leg2"), 400.0);
  EXPECT_TRUE(settings.servo.feedforward);
  const ScenarioResult each =
      LoadWith("{mode: servo, kp: {leg1: 1, leg2: 2, leg3: 3}, kv: 4, feedforward: none}");
  ASSERT_TRUE(each.scenario) << each.diagnostics.Text();
  EXPECT_EQ(each.scenario->simulation.servo.kp.Of("leg2"), 2.0);
  EXPECT_FALSE(each.scenario->simulation.servo.feedforward);
}

TEST(ServoSettings, WrongGainsAreFindings) {
  EXPECT_TRUE(Says(Messages("{mode: servo, kp: 1}"), "kv"));
  EXPECT_TRUE(Says(Messages("{mode: servo, kp: -1, kv: 1}"), "simulation.kp > 0"));
  EXPECT_TRUE(Says(Messages("{mode: servo, kp: {leg1: 1}, kv: 1}"),
                   "simulation.kp gives nothing for leg2, leg3"));
  EXPECT_TRUE(Says(Messages("{mode: servo, kp: {leg1: 1, leg2: 1, leg3: 1, leg4: 1}, kv: 1}"),
                   "there is no drive 'leg4'"));
  EXPECT_TRUE(Says(Messages("{mode: forward, kp: 1}"), "of no use without mode: servo"));
}

TEST(ServoSettings, WhatDoesNotGoTogetherIsReported) {
  EXPECT_TRUE(Says(Messages("{mode: force_driven, engine: stock}"), "engine: corrected only"));
  const ScenarioResult free = LoadScenarioText(
      "mechanism: spring_cart\n"
      "motion: {duration_s: 1, sample_s: 0.01, initial: {motor: 0.1}}\n"
      "forces: {motor: 0}\n"
      "simulation: {mode: force_driven}\n",
      "scenarios/spring_cart/t.yaml");
  EXPECT_TRUE(Says(free.diagnostics.Text(), "every degree of freedom needs a command"));
}

TEST(ServoSettings, LimitsAgainstTheCommandHaveNoDefault) {
  EXPECT_FALSE(CheckLimits()[Metric::kPositionM].servo);
  const ScenarioResult result =
      LoadWith("{mode: servo, kp: 1, kv: 1}", "checks: {position_m: {servo: 1e-4}}\n");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  EXPECT_EQ(result.scenario->checks[Metric::kPositionM].servo, 1e-4);
  EXPECT_EQ(result.scenario->checks[Metric::kPositionM].forward,
            DefaultLimits(*result.mechanism)[Metric::kPositionM].forward);
}

}  // namespace
}  // namespace mbv
