// Position analysis of the SCARA robot: hand-checkable numbers, then laws.
#include "analytic/scara_robot/workspace.h"
#include "tests/analytic/scara_robot_fixture.h"

namespace mbv::scara_robot {
namespace {

// Angles come from a few roundings of numbers of order one.
constexpr double kAngleTolerance = 64 * kEps;

TEST(ScaraPosition, InverseMatchesTheHandComputedCentreLine) {
  // At x = y = 0, φ = 0 every limb is planar with q_r = r − R = −50 mm and q_t = 0.
  const struct {
    double z_mm, theta12_deg, theta34_deg;
  } rows[] = {{-165, 30.8866, 26.0365}, {-100, 12.9722, -5.0600}, {-230, 52.3598, 53.7364}};
  constexpr double kPrintedDigits_deg = 0.5e-4 + 1e-9;
  const Parameters p = PaperParameters();
  for (const auto& row : rows) {
    Position position;
    ASSERT_TRUE(InversePosition(p, PoseOf(0, 0, row.z_mm, 0), &position).ok());
    EXPECT_NEAR(position.theta[0] / kDeg, row.theta12_deg, kPrintedDigits_deg);
    EXPECT_NEAR(position.theta[1] / kDeg, row.theta12_deg, kPrintedDigits_deg);
    EXPECT_NEAR(position.theta[2] / kDeg, row.theta34_deg, kPrintedDigits_deg);
    EXPECT_NEAR(position.theta[3] / kDeg, row.theta34_deg, kPrintedDigits_deg);
  }
}

TEST(ScaraPosition, ShortRodOnlyShiftsTheHeightOfItsLimb) {
  Parameters short_rss = PaperParameters();
  short_rss.l3 = short_rss.l2;
  Position with_drop, lifted;
  ASSERT_TRUE(InversePosition(short_rss, PoseOf(0, 0, -165, 0), &with_drop).ok());
  ASSERT_TRUE(InversePosition(short_rss, PoseOf(0, 0, -115, 0), &lifted).ok());
  EXPECT_NEAR(with_drop.theta[0], lifted.theta[2], kAngleTolerance);
}

TEST(ScaraPosition, EquationTenWithCorrectedSignsGivesTheSameAngles) {
  const Parameters p = PaperParameters();
  for (const Vec4& X : QuadrantPoses(50, 11)) {
    Position position;
    ASSERT_TRUE(InversePosition(p, X, &position).ok());
    for (int i = 0; i < kLimbs; ++i) {
      const double L = p.rod_length(i);
      const Vec3 q = p.l1 * position.u[i] + L * position.eta[i];
      const double E = 2 * p.l1 * q.z(), F = -2 * p.l1 * q.dot(Radial(i));
      const double G = q.squaredNorm() + p.l1 * p.l1 - L * L;
      const double theta = 2 * std::atan((-E - std::sqrt(E * E + F * F - G * G)) / (G - F));
      EXPECT_NEAR(theta, position.theta[i], 1e3 * kEps) << "limb " << i + 1;
    }
  }
}

TEST(ScaraPosition, InverseClosesEveryLoopOnBothBranches) {
  for (const double branch : {1.0, -1.0}) {
    Parameters p = PaperParameters();
    p.branch = branch;
    for (const Vec4& X : QuadrantPoses(50, 12)) {
      Position at;
      ASSERT_TRUE(InversePosition(p, X, &at).ok());
      for (int i = 0; i < kLimbs; ++i) {
        EXPECT_NEAR(at.eta[i].norm(), 1.0, kAngleTolerance);
        EXPECT_GT(branch * at.V[i], 0.0) << "limb " << i + 1 << " branch " << branch;
        const Vec3 B = p.R * Radial(i) + p.l1 * at.u[i] + p.rod_length(i) * at.eta[i] -
                       p.drop(i) * Vec3::UnitZ();
        EXPECT_LT((B - X.head<3>() - at.s[i]).norm(), kAngleTolerance);
      }
    }
  }
}

TEST(ScaraPosition, ForwardUndoesInverse) {
  const Parameters p = PaperParameters();
  for (const Vec4& X : QuadrantPoses(100, 13)) {
    Position at, found;
    ASSERT_TRUE(InversePosition(p, X, &at).ok());
    const Vec4 start = X + PoseOf(3, -2, 4, 2);
    ASSERT_TRUE(SolveForwardPosition(p, at.theta, start, &found).ok());
    // Round-off of the rod lengths is magnified by at most 1/s_min = 20.
    EXPECT_LT((found.X - X).cwiseAbs().maxCoeff(), 20 * 64 * kEps);
  }
}

TEST(ScaraPosition, MirrorAtTheDiagonalExchangesTheLimbs) {
  const Parameters p = PaperParameters();
  for (const Vec4& X : QuadrantPoses(20, 14)) {
    Position at, mirrored;
    ASSERT_TRUE(InversePosition(p, X, &at).ok());
    ASSERT_TRUE(InversePosition(p, MirrorPose(X), &mirrored).ok());
    EXPECT_LT((mirrored.theta - MirrorLimbs(at.theta)).cwiseAbs().maxCoeff(), kAngleTolerance);
  }
}

TEST(ScaraPosition, LimbOneIsFoldedAtItsDeadPoint) {
  Position at;
  const Parameters p = PaperParameters();
  ASSERT_TRUE(InversePosition(p, PoseOf(50, 0, -100, 0), &at).ok());
  // |A1 D1| = l2 − l1: the angle grows with the square root of the rounding of the lengths.
  EXPECT_NEAR(at.theta[0], -std::numbers::pi / 2, 1e-7);
  EXPECT_NEAR(at.V[0], 0.0, 1e-7);
  const RunSummary summary = CheckRegular(at, Measure(p, at));
  EXPECT_EQ(summary.stop, Stop::kSingular);
  EXPECT_EQ(summary.where, "limb1");
}

TEST(ScaraPosition, UnreachablePoseNamesTheLimbAndTheMissingReach) {
  Position at;
  // With the printed sign of e, |A1 D1| = 284 mm exceeds l1 + l2 = 250 mm at the bottom.
  Parameters printed = PaperParameters();
  printed.e = -printed.e;
  const RunSummary summary = InversePosition(printed, PoseOf(0, 0, -230, 0), &at);
  EXPECT_EQ(summary.stop, Stop::kUnreachable);
  EXPECT_EQ(summary.where, "limb1");
  EXPECT_NEAR(summary.amount, std::hypot(0.050, 0.280) - 0.250, 1e-15);
}

TEST(ScaraPosition, ForwardTrackingReachesTheScenarioRanges) {
  // Ranges over one period, in the digits of the description of the scenarios.
  const struct {
    SineCase motion;
    Vec4 low, high;
  } rows[] = {{DefaultCase(), PoseOf(-50.6, 62.0, -138.3, 2.0), PoseOf(-14.8, 78.1, -108.9, 51.2)},
              {AxisCase(), PoseOf(-63.2, -61.2, -143.6, 13.3), PoseOf(-34.4, -38.1, -116.6, 15.4)}};
  const Vec4 kDigits = PoseOf(0.06, 0.06, 0.06, 0.06);
  for (const auto& row : rows) {
    Parameters p = PaperParameters();
    p.home_X = row.motion.home_X;
    Position at;
    ASSERT_TRUE(InversePosition(p, p.home_X, &at).ok());
    const Vec4 home = at.theta;
    Vec4 low = p.home_X, high = p.home_X;
    ForwardTracker tracker(p);
    for (int i = 0; i <= 400; ++i) {
      const double phase = 2 * std::numbers::pi * i / 400;
      ASSERT_TRUE(tracker.Follow(home + row.motion.amplitude * std::sin(phase), &at).ok());
      low = low.cwiseMin(at.X);
      high = high.cwiseMax(at.X);
    }
    EXPECT_TRUE(((low - row.low).cwiseAbs().array() < kDigits.array()).all()) << low.transpose();
    EXPECT_TRUE(((high - row.high).cwiseAbs().array() < kDigits.array()).all()) << high.transpose();
  }
}

TEST(ScaraPosition, ForwardTrackingDoesNotDependOnTheWayThere) {
  Parameters p = PaperParameters();
  const SineCase motion = DefaultCase();
  p.home_X = motion.home_X;
  Position home, stepped, at_once;
  ASSERT_TRUE(InversePosition(p, p.home_X, &home).ok());
  ForwardTracker slow(p), fast(p);
  for (int i = 1; i <= 50; ++i) {
    ASSERT_TRUE(slow.Follow(home.theta + motion.amplitude * (i / 50.0), &stepped).ok());
  }
  ASSERT_TRUE(fast.Follow(home.theta + motion.amplitude, &at_once).ok());
  EXPECT_LT((stepped.X - at_once.X).cwiseAbs().maxCoeff(), 20 * 64 * kEps);
}

TEST(ScaraPosition, LiteralPatternStopsAtASingularPose) {
  // From the default home the pattern (+, −, +, −) ends at +6.5° (dead point of limb 2) and −3.3°
  // (det J_θ = 0).
  Parameters p = PaperParameters();
  p.home_X = DefaultCase().home_X;
  Position home, at;
  ASSERT_TRUE(InversePosition(p, p.home_X, &home).ok());
  const auto follow = [&](double degrees) {
    ForwardTracker tracker(p);
    return tracker.Follow(home.theta + degrees * kDeg * Vec4(1, -1, 1, -1), &at);
  };
  EXPECT_TRUE(follow(6.3).ok());
  const RunSummary up = follow(6.7);
  EXPECT_EQ(up.stop, Stop::kSingular);
  EXPECT_EQ(up.where, "limb2");
  EXPECT_TRUE(follow(-3.2).ok());
  const RunSummary down = follow(-3.5);
  EXPECT_EQ(down.stop, Stop::kSingular);
  EXPECT_LT(down.amount, kNearlySingular);
}

TEST(ScaraPosition, TopologyGivesThreeTranslationsAndOneRotation) {
  const DofCount count = CountDofs();
  EXPECT_EQ(count.limb_dofs, (std::array<int, 4>{5, 5, 6, 6}));
  EXPECT_EQ(count.loop_equations, (std::array<int, 3>{6, 6, 6}));
  EXPECT_EQ(count.dofs, 4);
  EXPECT_EQ(count.platform_translations, 3);
  EXPECT_EQ(count.platform_rotations, 1);
  EXPECT_NEAR(std::abs(count.rotation_axis.z()), 1.0, kAngleTolerance);
}

}  // namespace
}  // namespace mbv::scara_robot
