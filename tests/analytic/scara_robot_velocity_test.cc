// Velocity, acceleration and singularity of the SCARA robot.
#include "analytic/scara_robot/velocity.h"

#include "tests/analytic/scara_robot_fixture.h"

namespace mbv::scara_robot {
namespace {

/// Sixth-order central difference of f at 0; its round-off is about eps·|f|/h.
template <typename F>
auto CentralDifference(const F& f, double h) {
  return ((45.0 * (f(h) - f(-h)) - 9.0 * (f(2 * h) - f(-2 * h)) + (f(3 * h) - f(-3 * h))) /
          (60.0 * h))
      .eval();
}

constexpr double kStep = 2e-4;
// 90/60·eps·|θ|/h for angles up to 2, and h⁶ of functions whose scale is the arm's length.
constexpr double kDifferenceTolerance = 3 * 2 * kEps / kStep + 1e-8;

TEST(ScaraVelocity, JacobianIsTheDerivativeOfTheInversePosition) {
  const Parameters p = PaperParameters();
  for (const Vec4& X : QuadrantPoses(30, 21)) {
    Position at;
    ASSERT_TRUE(InversePosition(p, X, &at).ok());
    const Mat4 J = InverseJacobian(p, at).cwiseInverse().asDiagonal() * DirectJacobian(at);
    for (int c = 0; c < kLimbs; ++c) {
      const double h = c == 3 ? kStep : kStep * p.l1;
      const auto theta = [&](double step) {
        Position moved;
        EXPECT_TRUE(InversePosition(p, X + step * Vec4::Unit(c), &moved).ok());
        return moved.theta;
      };
      const double scale = c == 3 ? 1.0 : 1.0 / p.l1;
      EXPECT_LT((CentralDifference(theta, h) - J.col(c)).cwiseAbs().maxCoeff(),
                scale * kDifferenceTolerance);
    }
  }
}

TEST(ScaraVelocity, AccelerationFormIsTheSecondDerivativeAlongAStraightPath) {
  const Parameters p = PaperParameters();
  std::mt19937_64 random(22);
  std::normal_distribution<double> normal;
  for (const Vec4& X : QuadrantPoses(30, 23)) {
    Instant at;
    at.rates.dX = Vec4(normal(random), normal(random), normal(random), 10 * normal(random)) * p.l1;
    ASSERT_TRUE(InversePosition(p, X, &at.position).ok());
    const auto rate = [&](double step) {
      Instant moved;
      moved.rates.dX = at.rates.dX;
      EXPECT_TRUE(InversePosition(p, X + step * at.rates.dX, &moved.position).ok());
      DriveRates(p, moved.position, &moved.rates);
      return moved.rates.dtheta;
    };
    DriveRates(p, at.position, &at.rates);
    const double scale = std::max(1.0, at.rates.dtheta.cwiseAbs().maxCoeff());
    EXPECT_LT((CentralDifference(rate, kStep) - at.rates.ddtheta).cwiseAbs().maxCoeff(),
              10 * scale * kDifferenceTolerance);
  }
}

TEST(ScaraVelocity, PlatformRatesUndoDriveRates) {
  const Parameters p = PaperParameters();
  for (double t = 0.005; t < 0.4; t += 0.01) {
    const Instant at = PickPlaceInstant(p, t);
    Rates back = at.rates;
    back.dX.setZero();
    back.ddX.setZero();
    PlatformRates(p, at.position, &back);
    // One solution with J_θ, whose s_min is 0.128.
    EXPECT_LE((back.dX - at.rates.dX).norm(), 1e3 * kEps * at.rates.dX.norm());
    EXPECT_LE((back.ddX - at.rates.ddX).norm(),
              1e4 * kEps * (at.rates.ddX.norm() + at.rates.ddtheta.norm()));
  }
}

TEST(ScaraVelocity, CentreLineIsSingularAtZeroYaw) {
  const Parameters p = PaperParameters();
  for (const double z_mm : {-100.0, -165.0, -230.0}) {
    Position at;
    ASSERT_TRUE(InversePosition(p, PoseOf(0, 0, z_mm, 0), &at).ok());
    const RunSummary summary = CheckRegular(at, Measure(p, at));
    EXPECT_EQ(summary.stop, Stop::kSingular);
    EXPECT_EQ(summary.where, "platform");
  }
}

TEST(ScaraVelocity, EqualLimbsWouldBeSingularOnTheCentreLineForEveryYaw) {
  Parameters equal = PaperParameters();
  equal.e = 0.0;
  equal.l3 = equal.l2;
  for (const double z_mm : {-110.0, -165.0, -200.0}) {
    for (const double phi_deg : {-40.0, 0.0, 25.0}) {
      Position at;
      ASSERT_TRUE(InversePosition(equal, PoseOf(0, 0, z_mm, phi_deg), &at).ok());
      EXPECT_LT((Vec4(1, -1, 1, -1).transpose() * DirectJacobian(at)).norm(), 64 * kEps);
    }
  }
}

TEST(ScaraVelocity, CentreIsAlmostSingularForEveryYaw) {
  const Parameters p = PaperParameters();
  const struct {
    double phi, s_min, s_digits, det, det_digits;
  } rows[] = {{0.3, 0.0003, 0.5e-4, 5.5e-4, 0.5e-5}, {0.8, 0.0020, 0.5e-4, 5.8e-3, 0.5e-4}};
  for (const auto& row : rows) {
    Position at;
    ASSERT_TRUE(InversePosition(p, Vec4(0, 0, -0.165, row.phi), &at).ok());
    const Singularity singularity = Measure(p, at);
    EXPECT_NEAR(singularity.s_min, row.s_min, row.s_digits);
    EXPECT_NEAR(singularity.det, row.det, row.det_digits);
    EXPECT_TRUE(CheckRegular(at, singularity).ok());
  }
}

TEST(ScaraVelocity, SingularValuesAlongTheScenariosAreAsDescribed) {
  const Parameters p = PaperParameters();
  const struct {
    SineCase motion;
    double s_min, V_min, det_low, det_high;
  } rows[] = {{DefaultCase(), 0.136, 0.34, 0.31, 0.42}, {AxisCase(), 0.053, 0.60, -0.32, -0.09}};
  for (const auto& row : rows) {
    double s_min = 1, V_min = 1, det_low = 1, det_high = -1;
    for (double t = 0; t < 10; t += 0.05) {
      const Singularity at = Measure(p, SineInstant(p, row.motion, t).position);
      s_min = std::min(s_min, at.s_min);
      V_min = std::min(V_min, at.V_min);
      det_low = std::min(det_low, at.det);
      det_high = std::max(det_high, at.det);
    }
    EXPECT_NEAR(s_min, row.s_min, 0.6e-3);
    EXPECT_NEAR(V_min, row.V_min, 0.6e-2);
    EXPECT_NEAR(det_low, row.det_low, 0.6e-2);
    EXPECT_NEAR(det_high, row.det_high, 0.6e-2);
  }
}

}  // namespace
}  // namespace mbv::scara_robot
