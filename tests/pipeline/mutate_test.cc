// Detection power on the shipped scenarios: which parameters may be 0.1 % wrong on the simulated
// side without anybody noticing? Every name below has a physical reason.
#include "pipeline/mutate.h"

#include <gtest/gtest.h>

#include <set>

namespace mbv {
namespace {

using Names = std::set<std::string>;

MutationReport Mutate(const std::string& scenario, MutationOptions options = {}) {
  return MutateScenario(std::string(MBV_SOURCE_DIR) + "/scenarios/" + scenario + ".yaml", options);
}

Names Undetected(const MutationReport& report) {
  Names names;
  for (const Mutation& m : report.mutations) {
    if (!m.detected) names.insert(m.parameter);
  }
  return names;
}

const Mutation* Find(const MutationReport& report, const std::string& parameter) {
  for (const Mutation& m : report.mutations) {
    if (m.parameter == parameter) return &m;
  }
  return nullptr;
}

TEST(Mutate, OnTheStabilizingPlatformOnlyWhatCannotActStaysUnseen) {
  const MutationReport report = Mutate("stabilizing_platform/sea_state");
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  EXPECT_EQ(Undetected(report),
            (Names{
                "I_p_x", "I_p_y",    // the platform stays level: it only turns about z
                "m_ship", "I_ship",  // the ship's motion is prescribed
                "z_0",               // the height is commanded; in the model it starts the solver
                "l_0", "lambda_0", "D_0", "q1_0", "q2_0",  // where the home solution starts
            }));
  EXPECT_EQ(report.mutations.size(), 44u);
}

TEST(Mutate, OnTheTripodOnlyWhatCannotActStaysUnseen) {
  const MutationReport report = Mutate("spr_tripod/default_inverse");
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  EXPECT_EQ(Undetected(report),
            (Names{
                "I_platform_xx",  // the path lies in the plane of leg 3: no turn about x …
                "I_platform_zz",  // … nor about z
                "tool_z",         // the point of a load that this scenario does not have
            }));
  // Home and the strokes that define it turn the axes in which reactions are reported.
  for (const char* name : {"q_home", "z_home", "q_min", "q_max"}) {
    const Mutation* m = Find(report, name);
    ASSERT_NE(m, nullptr) << name;
    EXPECT_FALSE(m->by_force) << name;
    EXPECT_EQ(m->best_check, "simulated_vs_analytic.reaction_nrmse") << name;
  }
}

TEST(Mutate, OnTheScaraRobotOnlyWhatCannotActStaysUnseen) {
  const MutationReport report = Mutate("scara_robot/pick_place");
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  EXPECT_EQ(Undetected(report),
            (Names{
                "I_p_x",     "I_p_y",      "I_plate_x",
                "I_plate_y", "I_plate_xy",             // only turns about z
                "bar_com",   "I_bar_y",    "I_bar_z",  // the bars move without turning
                "ball_mass", "pivot_mass",             // moved between bodies that share the point
                "d",                                   // the width of a parallelogram
                "home_x",    "home_y",     "home_z",
                "home_phi",  "branch",                   // where the solution starts
                "theta_min", "theta_max",  "shear_max",  // ranges
            }));
  // A flat bar's inertias obey x = y + z; one alone that is larger is no rigid body.
  const Mutation* bar = Find(report, "I_bar_x");
  ASSERT_NE(bar, nullptr);
  EXPECT_FALSE(bar->ran);
}

TEST(Mutate, OnTheCabinRobotOnlyWhatCannotActStaysUnseen) {
  const MutationReport report = Mutate("cabin_robot/zero_g");
  EXPECT_EQ(report.exit_code, 0) << report.diagnostics.Text();
  Names expected{
      "c_carriage_y",  // the carriage and the sliders move without turning
      "w",             // pictures
      "I_AB_x",
      "I_AB_y",
      "I_CD_x",
      "I_CD_y",
      "I_EF_x",
      "I_EF_y",  // links turn about z only
      "I_platform_x",
      "I_platform_y",  // so does the platform
      "Y_home",
      "d1_home",
      "d5_home",
      "alpha_home",
      "beta_home",
      "epsilon_home",  // start
  };
  for (const char* body : {"carriage", "sliderA", "sliderD", "sliderF"}) {
    for (const char* axis : {"_x", "_y", "_z"}) expected.insert("I_" + std::string(body) + axis);
  }
  EXPECT_EQ(Undetected(report), expected);
}

TEST(Mutate, ASmallErrorIsMissedAndSaysSo) {
  const MutationReport report = Mutate("spr_tripod/default_inverse",
                                       {.size = 1e-10, .parameters = {"I_rod_zz"}, .progress = {}});
  ASSERT_EQ(report.mutations.size(), 1u);
  EXPECT_FALSE(report.mutations[0].detected);
  EXPECT_FALSE(report.mutations[0].reason.empty());
}

TEST(Mutate, TheSmallestDetectableErrorIsPredictedFromALargeOne) {
  const MutationOptions options{.size = 1e-3, .parameters = {"m_rod"}, .progress = {}};
  const MutationReport large = Mutate("spr_tripod/default_inverse", options);
  ASSERT_EQ(large.mutations.size(), 1u);
  const double smallest = large.mutations[0].smallest;
  const auto detected_at = [&](double size) {
    return Mutate("spr_tripod/default_inverse",
                  {.size = size, .parameters = {"m_rod"}, .progress = {}})
        .mutations[0]
        .detected;
  };
  EXPECT_TRUE(detected_at(2 * smallest));
  EXPECT_FALSE(detected_at(0.5 * smallest));
}

TEST(Mutate, AScenarioThatDisagreesIsNotBent) {
  const MutationReport report = Mutate("spr_tripod/must_fail/analytic_mass");
  EXPECT_NE(report.exit_code, 0);
  EXPECT_TRUE(report.mutations.empty());
}

}  // namespace
}  // namespace mbv
