// Equality rows along the motion of a four-bar, against its closed form.
#include "simulation/engine/row_survey.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/mechanisms/simulated.h"

namespace mbv {
namespace {

using fixtures::FourBar;

constexpr double kStep = 1e-3;

// θ = 1 + 2 t: with constant rates of the joints, the ends of coupler and rocker that the loop
// joins have accelerations towards the hinges only. [m/s²]
RunSummary TurnEvenly(double t, DrivenSample* driven) {
  driven->position = VecX::Constant(1, FourBar::kHomeAngle + 2.0 * t);
  driven->velocity = VecX::Constant(1, 2.0);
  driven->acceleration = VecX::Zero(1);
  return RunSummary::Done();
}

Vec3 VelocityTerm(double angle, double rate) {
  const FourBar bar(angle);
  const auto towards = [](double length, double turn, double w) {
    return Vec3(-length * w * w * Vec3(std::cos(turn), std::sin(turn), 0.0));
  };
  return towards(FourBar::a, bar.t1, rate) + towards(FourBar::b, bar.t2, bar.k2() * rate) -
         towards(FourBar::c, bar.t3, bar.k3() * rate);
}

Motion Second() { return {.duration_s = 1.0, .sample_s = 0.1, .commands = {}, .loads = {}}; }

TEST(RowSurvey, FindsTheVelocityTermThatTheEngineLeavesOut) {
  const RowSurvey survey = SurveyRows(fixtures::MakeFourBar(JointKind::kSpherical), Second(),
                                      TurnEvenly, {0.0, 0.5, 1.0}, kStep);
  ASSERT_TRUE(survey.summary.ok()) << survey.summary.message;
  ASSERT_EQ(survey.states.size(), 3U);
  ASSERT_EQ(survey.kinds, (std::vector<std::string>{"connect", "connect", "connect", "joint"}));
  EXPECT_EQ(survey.equalities.back(), "drive:motor");
  EXPECT_EQ(survey.driven, std::vector<std::string>{"motor"});
  for (const SurveyedState& surveyed : survey.states) {
    const Vec3 expected = VelocityTerm(FourBar::kHomeAngle + 2.0 * surveyed.time_s, 2.0);
    const Vec3 found = surveyed.velocity_term.head<3>();
    const double sign = found.dot(expected) > 0.0 ? 1.0 : -1.0;
    EXPECT_LT((sign * found - expected).norm(), 1e-12 * expected.norm());
    EXPECT_GT(expected.norm(), 0.1);
    EXPECT_LT(surveyed.present.bias.norm(), 1e-9 * expected.norm());  // 2.2.2 has none of it
    EXPECT_GT(surveyed.present.R.minCoeff(), 0.0);
    EXPECT_EQ(surveyed.state.targets.size(), 1);
    EXPECT_EQ(surveyed.present.force.size(), 1);
  }
}

TEST(RowSurvey, HandsWhatDoesNotGoOverToTheCaller) {
  Mechanism loose = fixtures::MakeFourBar(JointKind::kSpherical);
  loose.drives.clear();
  const RowSurvey undriven = SurveyRows(
      loose, Second(),
      [](double, DrivenSample* driven) {
        driven->position = driven->velocity = driven->acceleration = VecX();
        return RunSummary::Done();
      },
      {0.0}, kStep);
  EXPECT_EQ(undriven.summary.stop, Stop::kUnsupported);
  const RowSurvey stopped = SurveyRows(
      fixtures::MakeFourBar(JointKind::kSpherical), Second(),
      [](double, DrivenSample*) {
        return RunSummary{.stop = Stop::kSingular, .message = "there", .where = {}, .unit = {}};
      },
      {0.0}, kStep);
  EXPECT_EQ(stopped.summary.stop, Stop::kSingular);
}

}  // namespace
}  // namespace mbv
