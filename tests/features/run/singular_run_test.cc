// How near a scenario's motion comes to singular poses, and when a run warns of it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

using testing::HasSubstr;
using testing::Not;

class SingularRun : public testing::Test {
 protected:
  struct Answer {
    nlohmann::json singularity;
    std::string text;
  };
  // Of the shipped four-bar, links 0.15, 0.35, 0.3 and 0.4 m, the rocker is commanded and the crank
  // driven. The rocker turns back at yaw 90°, where crank and coupler lie in one line (3-4-5).
  [[nodiscard]] Answer Swing(double degrees_short_of_it) const {
    double low = 1.6, high = 2.6;  // home's yaw: the crank upright
    for (int i = 0; i < 60; ++i) {
      const double yaw = 0.5 * (low + high);
      const double gap = std::hypot(0.4 + 0.3 * std::cos(yaw), 0.3 * std::sin(yaw) - 0.15) - 0.35;
      (gap > 0.0 ? low : high) = yaw;
    }
    const std::string file = (mbverify.folder() / "swing.yaml").string();
    std::ofstream(file) << fmt::format(
        R"(
mechanism: four_bar
motion:
  duration_s: 1
  sample_s: 0.002
  commands:
    rocker.yaw: [home, {{sine: {{amplitude_deg: {:.17g}, period_s: 1}}}}]
analytic: none
simulation: {{mode: inverse}}
snapshots: {{times_s: []}}
)",
        low * 180 / std::numbers::pi - 90 - degrees_short_of_it);
    const ProgramResult result =
        mbverify("run '" + file + "' --no-pictures --no-report --out '" + mbverify.Out() + "'");
    EXPECT_EQ(result.exit_code, 0) << result.err << result.out;
    const std::string json = ReadAll(mbverify.folder() / "out/four_bar/swing/summary.json");
    return {nlohmann::json::parse(json)["singularity"], result.out + result.err};
  }
  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(SingularRun, ARockerIsWarnedOfNearItsDeadCentreAndNotBefore) {
  const Answer some = Swing(0.05);
  EXPECT_EQ(some.singularity["inverse_of"][0], "rocker.yaw");
  const auto& inverse = some.singularity["least"][0];
  EXPECT_EQ(inverse["kind"], "inverse");
  EXPECT_EQ(inverse["close"], false);
  EXPECT_EQ(inverse["asked"], true);
  EXPECT_NEAR(inverse["time_s"].get<double>(), 0.75, 1e-9);
  EXPECT_GT(inverse["force"]["near"].get<double>(), 2 * inverse["force"]["median"].get<double>());
  // Near it the distance goes with the root of what is left: a tenth on both sides of 0.02.
  const double c = std::pow(inverse["distance"].get<double>(), 2) / 0.05;
  const Answer before = Swing(0.022 * 0.022 / c), beyond = Swing(0.018 * 0.018 / c);
  EXPECT_NEAR(before.singularity["least"][0]["distance"].get<double>(), 0.022, 2e-4);
  EXPECT_NEAR(beyond.singularity["least"][0]["distance"].get<double>(), 0.018, 2e-4);
  EXPECT_THAT(before.text, Not(HasSubstr("close to a singular pose")));
  EXPECT_THAT(beyond.text, HasSubstr("close to a singular pose, inverse (type 1), at t = 0.75 s"));
  EXPECT_EQ(beyond.singularity["least"][0]["close"], true);
  EXPECT_EQ(beyond.singularity["least"][1]["close"], false);
}

// Those of all shipped scenarios that come nearest: a slow screw, a robot's platform, a limb.
TEST_F(SingularRun, ShippedMotionsAreNotWarnedOf) {
  for (const auto& [scenario, kind, least] :
       {std::tuple("machine_five_bar/draw_inverse", 0, 0.0342),
        std::tuple("scara_robot/tool_load", 1, 0.0667),
        std::tuple("stabilizing_platform/hold_still", 2, 0.290)}) {
    const ProgramResult result =
        mbverify(std::string("run ") + scenario + " --no-pictures --no-report --out '" +
                 mbverify.Out() + "'");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out + result.err, Not(HasSubstr("close to a singular pose"))) << scenario;
    const auto json =
        nlohmann::json::parse(ReadAll(mbverify.folder() / "out" / scenario / "summary.json"));
    EXPECT_NEAR(json["singularity"]["least"][kind]["distance"].get<double>(), least, 1e-3);
  }
}

TEST_F(SingularRun, ShippedMotionsThroughSingularPosesAre) {
  for (const auto& [scenario, kind] :
       {std::pair("scara_robot/must_fail/singular_line", "forward (type 2)"),
        std::pair("scara_robot/must_fail/singular_centre", "forward (type 2)"),
        std::pair("n_four_bar/must_fail/lying", "constraint")}) {
    const ProgramResult result =
        mbverify(std::string("run ") + scenario + " --no-pictures --no-report --out '" +
                 mbverify.Out() + "'");
    EXPECT_THAT(result.out + result.err,
                HasSubstr(std::string("close to a singular pose, ") + kind))
        << scenario;
  }
}

}  // namespace
}  // namespace mbv
