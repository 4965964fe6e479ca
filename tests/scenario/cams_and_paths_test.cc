// Cams and rounded paths in scenario files: what they give, and what is said about wrong ones.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using std::numbers::pi;

ScenarioResult WithCommand(const std::string& model, const std::string& motion) {
  return LoadScenarioText(std::string("mechanism: ") + kSourceDir + "/models/" + model +
                              "/model.yaml\nmotion: " + motion + "\nanalytic: none\n",
                          "s.yaml");
}

Profile Cam(const std::string& cam) {
  const ScenarioResult result =
      WithCommand("slider_crank", "{duration_s: 3, commands: {slider.z: {cam: " + cam + "}}}");
  EXPECT_TRUE(result.scenario) << result.diagnostics.Text();
  return result.scenario ? result.scenario->motion.commands[0].profile : Profile{};
}

TEST(Cams, RiseDwellReturnAndRepeat) {
  const Profile cam = Cam(
      "{law: cycloid, start_s: 0.1, cycles: 2, segments: [{rise_mm: 20, duration_s: 0.3},"
      " {dwell_s: 0.2}, {return_mm: 20, duration_s: 0.4, law: modified_sine}, {dwell_s: 0.1}]}");
  for (const double round : {0.0, 1.0}) {
    EXPECT_NEAR(Evaluate(cam, round + 0.1).value, 0.0, 1e-17);
    EXPECT_NEAR(Evaluate(cam, round + 0.25).value, 0.01, 1e-15);
    EXPECT_NEAR(Evaluate(cam, round + 0.25).rate, 2 * 0.02 / 0.3,
                1e-13);  // cycloid: twice the mean
    EXPECT_NEAR(Evaluate(cam, round + 0.5).value, 0.02, 1e-15);
    EXPECT_NEAR(Evaluate(cam, round + 0.8).rate, -4 * pi / (4 + pi) * 0.02 / 0.4, 1e-13);
  }
  EXPECT_NEAR(Evaluate(cam, 2.5).value, 0.0, 1e-16);
  // Rest at every end of a segment: rate and acceleration are continuous.
  for (const double t : {0.1, 0.4, 0.6, 1.0, 1.1, 1.4, 1.6, 2.0}) {
    EXPECT_NEAR(Evaluate(cam, t).rate, 0.0, 1e-13) << t;
    EXPECT_NEAR(Evaluate(cam, t).acceleration, 0.0, 1e-11) << t;
  }
}

TEST(Cams, KnowEveryLawOfSteps) {
  // The rate at the middle of a step, of its mean.
  const std::pair<const char*, double> peaks[] = {{"poly345", 1.875},
                                                  {"poly4567", 2.1875},
                                                  {"cycloid", 2.0},
                                                  {"modified_sine", 4 * pi / (4 + pi)}};
  for (const auto& [law, peak] : peaks) {
    const Profile cam =
        Cam(std::string("{law: ") + law + ", segments: [{rise: 0.01, duration_s: 2}]}");
    EXPECT_NEAR(Evaluate(cam, 1.0).rate, peak * 0.005, 1e-15) << law;
  }
}

TEST(Cams, ThatDoNotCloseAreRefused) {
  const std::string text =
      WithCommand("slider_crank",
                  "{duration_s: 1, commands: {slider.z: {cam: {cycles: 2, segments:"
                  " [{rise: 0.02, duration_s: 0.3}, {return: 0.01, duration_s: 0.3}]}}}}")
          .diagnostics.Text();
  EXPECT_NE(text.find("rises less returns are 0.01 m, which violates 0 where cycles = 2"),
            std::string::npos)
      << text;
}

std::string Rounded(const std::string& more) {
  return "{path: {outputs: [platform.x, platform.y], points: [[0, 0], [0.1, 0], [0.1, 0.06],"
         " [0.02, 0.06]], " +
         more +
         "}, commands: {platform.z: home, platform.roll: 0, platform.pitch: 0,"
         " platform.yaw: 0}}";
}

TEST(RoundedPaths, KeepSpeedAndAccelerationWithinLimitsAndAreSmooth) {
  for (const char* law : {"", ", law: s_curve, j_max: 40"}) {
    const ScenarioResult result =
        WithCommand("stewart", Rounded(std::string("blend_mm: 15, v_max: 0.1, a_max: 1") + law));
    ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
    const Motion& motion = result.scenario->motion;
    ASSERT_EQ(motion.commands.size(), 6u);
    const Profile& x = motion.commands[4].profile;  // paths come last
    const Profile& y = motion.commands[5].profile;
    EXPECT_NEAR(Evaluate(x, motion.duration_s).value, 0.02, 1e-15);
    EXPECT_NEAR(Evaluate(y, motion.duration_s).value, 0.06, 1e-15);
    constexpr double h = 1e-4;
    double fastest = 0.0, hardest = 0.0, nearest = 1.0;
    for (double t = h; t + h < motion.duration_s; t += h) {
      const Jet jx = Evaluate(x, t), jy = Evaluate(y, t);
      fastest = std::max(fastest, std::hypot(jx.rate, jy.rate));
      hardest = std::max(hardest, std::hypot(jx.acceleration, jy.acceleration));
      nearest = std::min(nearest, std::hypot(jx.value - 0.1, jy.value));
      // No jumps of value and rate anywhere.
      EXPECT_NEAR(Evaluate(x, t + h).value - jx.value, h * jx.rate, h * h);
      EXPECT_NEAR(Evaluate(y, t + h).rate, jy.rate, 1.01 * h);
    }
    EXPECT_NEAR(fastest, 0.1, 1e-12);
    EXPECT_LE(hardest, 1.0 + 1e-9);
    // The middle of a corner of 90°: 3/8 r from the straights' ends towards the corner.
    EXPECT_NEAR(nearest, 0.015 * 3.0 / 16.0 * std::numbers::sqrt2, 1e-6);
  }
}

TEST(RoundedPaths, ThatDoNotFitAreRefusedWithWhatWould) {
  const auto findings = [](const std::string& more) {
    return WithCommand("stewart", Rounded(more)).diagnostics.Text();
  };
  EXPECT_NE(findings("blend: 0.04, v_max: 0.1, a_max: 1")
                .find("motion.path: segment 1 is 0.06 m long, its blends need 0.08 m\n"
                      "  hint: blend: 0.03 or less"),
            std::string::npos)
      << findings("blend: 0.04, v_max: 0.1, a_max: 1");
  EXPECT_NE(
      findings("blend: 0.015, v_max: 0.2, a_max: 1").find("the corner at point 1 takes 2.828"),
      std::string::npos)
      << findings("blend: 0.015, v_max: 0.2, a_max: 1");
  EXPECT_NE(findings("blend: 0.01, v_max: 0.1, a_max: 1, j_max: 3")
                .find("motion.path.j_max has a meaning with law: s_curve only"),
            std::string::npos);
  EXPECT_NE(findings("v_max: 0.1, a_max: 1, j_max: 3").find("unknown key 'j_max'"),
            std::string::npos);
  EXPECT_NE(findings("blend: 0.03, v_max: 0.1, a_max: 0.3").find("violates a_max = 0.3"),
            std::string::npos);
  EXPECT_NE(findings("blend: 0.001, v_max: 0.5, a_max: 1000, law: s_curve, j_max: 1")
                .find("speeding up to v_max = 0.5 takes"),
            std::string::npos)
      << findings("blend: 0.001, v_max: 0.5, a_max: 1000, law: s_curve, j_max: 1");
}

}  // namespace
}  // namespace mbv
