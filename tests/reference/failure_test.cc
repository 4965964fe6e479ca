// Commands that cannot be followed: each ends with its reason, time and place, never with NaN.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

TEST(ReferenceFailure, ARockerCommandedBeyondItsReachIsUnreachable) {
  Mechanism m = MakeFourBar();
  m.drives = {{.name = "rocker_motor", .kind = JointDrive{2, 0}, .range = {}}};
  const double home = m.joints[2].home[0];
  // The rocker of this crank-rocker swings by less than 180°.
  const ReferenceRun run =
      RunReference(m, DriveMotion(m, {{{ConstantTerm{home}, RampTerm{1.0}}}}, 3.0, 0.01));
  EXPECT_EQ(run.summary.stop, Stop::kUnreachable) << run.summary.message;
  EXPECT_EQ(run.summary.where, "C");
  EXPECT_EQ(run.summary.unit, "m");
  EXPECT_GT(run.summary.amount, 0.0);
  EXPECT_LT(run.summary.amount, 0.01);  // one sample beyond the dead point
  EXPECT_GT(run.summary.time_s, 0.1);
  // The dead point: crank and coupler in line.
  const double reach = FourBar::b - FourBar::a;
  const double far = FourBar::b + FourBar::a;
  const auto angle_at = [](double r) {
    return std::numbers::pi -
           std::acos((FourBar::d * FourBar::d + FourBar::c * FourBar::c - r * r) /
                     (2 * FourBar::d * FourBar::c));
  };
  const double reached = home + run.summary.time_s;
  const double nearest = std::min(std::abs(std::abs(reached) - angle_at(reach)),
                                  std::abs(std::abs(reached) - angle_at(far)));
  EXPECT_LT(nearest, 0.0101);
  // The same without the search for what stays open.
  const ReferenceRun brief =
      RunReference(m, DriveMotion(m, {{{ConstantTerm{home}, RampTerm{1.0}}}}, 3.0, 0.01),
                   {.explain_unreached = false});
  EXPECT_EQ(brief.summary.stop, Stop::kUnreachable);
  EXPECT_EQ(brief.summary.time_s, run.summary.time_s);
  EXPECT_EQ(brief.summary.where, "");
}

TEST(ReferenceFailure, AFirstPoseOutOfReachIsReportedAtTimeZero) {
  Mechanism m = MakeFourBar();
  Motion motion;
  motion.duration_s = 0.1;
  motion.sample_s = 0.1;
  motion.commands = {Commanded("tip.x", Coordinate::Kind::kOutput, 0, 0, Constant(1.5))};
  const ReferenceRun run = RunReference(m, motion);
  EXPECT_EQ(run.summary.stop, Stop::kUnreachable) << run.summary.message;
  EXPECT_DOUBLE_EQ(run.summary.time_s, 0.0);
  EXPECT_FALSE(run.summary.where.empty());
  EXPECT_TRUE(std::isnan(run.trace.values(0, 0)));
}

TEST(ReferenceFailure, TooFewOrTooManyCommandsAreRefused) {
  const Mechanism m = MakeFourBar();
  Motion none;
  none.duration_s = 0.0;
  EXPECT_EQ(RunReference(m, none).summary.stop, Stop::kUnsupported);
  Motion two = DriveMotion(m, {Constant(FourBar::kHomeAngle)}, 0.0, 0.1);
  two.commands.push_back(Commanded("tip.x", Coordinate::Kind::kOutput, 0, 0, Constant(0.1)));
  EXPECT_EQ(RunReference(m, two).summary.stop, Stop::kUnsupported);
}

TEST(ReferenceFailure, AMotionWithoutAnyDriveHasNoForce) {
  Mechanism m = MakeFourBar();
  m.drives.clear();
  Motion motion;
  motion.duration_s = 0.0;
  motion.commands = {Commanded("tip.x", Coordinate::Kind::kOutput, 0, 0,
                               Constant(m.X_WB_home[2].translation().x() + 0.3))};
  const RunSummary summary = RunReference(m, motion).summary;
  EXPECT_EQ(summary.stop, Stop::kSingular) << summary.message;
}

// A parallelogram lies flat at 0: there it may fold into the other branch.
TEST(ReferenceFailure, AParallelogramPassingThroughItsFlatPoseIsSingular) {
  const Mechanism m = MakeParallelogram(1.0);
  const ReferenceRun run =
      RunReference(m, DriveMotion(m, {{{ConstantTerm{1.0}, RampTerm{-1.0}}}}, 2.0, 0.013));
  EXPECT_EQ(run.summary.stop, Stop::kSingular) << run.summary.message;
  EXPECT_NEAR(run.summary.time_s, 1.0, 0.0131);
  EXPECT_FALSE(run.summary.where.empty());
}

TEST(ReferenceFailure, ASampleExactlyOnTheDeadPointIsSingularNotHuge) {
  Mechanism m = MakeFourBar();
  m.drives = {{.name = "rocker_motor", .kind = JointDrive{2, 0}, .range = {}}};
  const double home = m.joints[2].home[0];
  // Crank and coupler stretched to b + a: the rocker's largest angle.
  using F = FourBar;
  const double r = F::a + F::b;
  const double dead =
      std::numbers::pi - std::acos((F::d * F::d + F::c * F::c - r * r) / (2 * F::d * F::c));
  const ReferenceRun run = RunReference(
      m, DriveMotion(m, {{{ConstantTerm{home}, RampTerm{-(dead - home)}}}}, 1.0, 0.01));
  const ReferenceRun other =
      RunReference(m, DriveMotion(m, {{{ConstantTerm{home}, RampTerm{dead - home}}}}, 1.0, 0.01));
  // One of the two ways leads to this dead point; neither may end with endless forces.
  for (const ReferenceRun* way : {&run, &other}) {
    const Eigen::VectorXd forces = ColumnOf(way->trace, "rocker_motor.force");
    for (const double force : forces) EXPECT_FALSE(std::abs(force) > 1e9) << force;
  }
  EXPECT_FALSE(run.summary.ok() && other.summary.ok());
}

TEST(ReferenceFailure, CoarseSamplesStayOnTheBranch) {
  const Mechanism m = MakeFourBar();
  const Profile turn{{ConstantTerm{FourBar::kHomeAngle}, RampTerm{5.0}}};
  const ReferenceRun fine = RunReference(m, DriveMotion(m, {turn}, 3.0, 0.01));
  const ReferenceRun coarse = RunReference(m, DriveMotion(m, {turn}, 3.0, 0.3));
  ASSERT_TRUE(fine.summary.ok());
  ASSERT_TRUE(coarse.summary.ok()) << coarse.summary.message;
  for (Eigen::Index i = 0; i <= 10; ++i) {
    EXPECT_NEAR(At(coarse.trace, i, "motor.force"), At(fine.trace, 30 * i, "motor.force"), 1e-10);
  }
}

}  // namespace
}  // namespace mbv::fixtures
