// Stabilizing platform: each equation against an evaluation that shares nothing with it: poses
// closed by Newton on the vector loops and sixth-order differences in time.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "analytic/stabilizing_platform/position.h"
#include "math/spatial.h"
#include "tests/analytic/stabilizing_platform_differences.h"
#include "tests/analytic/stabilizing_platform_fixture.h"

namespace mbv::stabilizing_platform {
namespace {

// Loop closure by Newton: the platform's (x, y, yaw) with the tips in the radial planes of their
// feet, Eqs. (3), (4).
Vec3 ClosedPose(const PlatformParameters& p, const PoseCommand& c) {
  const Mat3 R_eo = RotX(c.roll.value) * RotY(c.pitch.value);
  const Vec3 p_eo = Vec3(0, 0, c.heave.value) + R_eo * Vec3(0, 0, p.s_r_so);
  auto residual = [&](const Vec3& q) {
    Vec3 r;
    for (int i = 0; i < 3; ++i) {
      const double psi = p.azimuth(i);
      const Vec3 B = RotZ(q.z()) * Vec3(p.r_b * std::cos(psi), p.r_b * std::sin(psi), 0) +
                     Vec3(q.x(), q.y(), c.platform[2].value);
      r[i] = Vec3(-std::sin(psi), std::cos(psi), 0).dot(R_eo.transpose() * (B - p_eo));
    }
    return r;
  };
  Vec3 q = Vec3::Zero();
  for (int iteration = 0; iteration < 12; ++iteration) {
    Mat3 J;
    for (int k = 0; k < 3; ++k) {
      const Vec3 d = 1e-5 * Vec3::Unit(k);
      J.col(k) = (residual(q + d) - residual(q - d)) / 2e-5;
    }
    q -= J.lu().solve(residual(q));
  }
  return q;
}

// Angles q1, q2 of one side by Newton on the vector loop (18).
Eigen::Vector2d ClosedSide(const PlatformParameters& p, double Y, double l, Eigen::Vector2d q) {
  for (int iteration = 0; iteration < 60; ++iteration) {
    const Eigen::Vector2d r(p.L1 * std::cos(q[0]) + p.L3 * std::cos(q[1]) - Y,
                            p.L1 * std::sin(q[0]) + p.L3 * std::sin(q[1]) - l);
    Eigen::Matrix2d J;
    J << -p.L1 * std::sin(q[0]), -p.L3 * std::sin(q[1]), p.L1 * std::cos(q[0]),
        p.L3 * std::cos(q[1]);
    const Eigen::Vector2d step = J.lu().solve(r);
    q -= step * std::min(1.0, 0.2 / step.norm());
  }
  return q;
}

// Everything the independent kinematics knows about a limb.
struct ClosedLimb {
  double l, tilt, R, q1, q2;
};
ClosedLimb CloseLimb(const PlatformParameters& p, const PoseCommand& c, int i) {
  const Vec3 q = ClosedPose(p, c);
  const Mat3 R_eo = RotX(c.roll.value) * RotY(c.pitch.value);
  const Vec3 p_eo = Vec3(0, 0, c.heave.value) + R_eo * Vec3(0, 0, p.s_r_so);
  const Mat3 R_psi = RotZ(p.azimuth(i));
  const Vec3 B = RotZ(q.z()) * R_psi * Vec3(p.r_b, 0, 0) + Vec3(q.x(), q.y(), c.platform[2].value);
  // Foot to tip in the limb's untilted frame.
  const Vec3 AB = R_psi.transpose() * R_eo.transpose() * (B - p_eo) - Vec3(p.r_a, 0, 0);
  ClosedLimb limb;
  limb.l = AB.norm();
  limb.tilt = std::atan2(AB.x(), AB.z());
  const Eigen::Vector2d angles = ClosedSide(p, p.L5, limb.l, {0.43, 2.54});
  limb.q1 = angles[0];
  limb.q2 = angles[1];
  const Eigen::Vector2d rod =
      p.L2 * Eigen::Vector2d(std::cos(limb.q1 + p.theta_3), std::sin(limb.q1 + p.theta_3));
  limb.R = (rod - Eigen::Vector2d(p.L5 + p.L4, 0)).norm();
  return limb;
}

std::vector<double> Instants() {
  std::mt19937_64 generator(20180352);
  std::uniform_real_distribution<double> time(0, 12);
  std::vector<double> t(25);
  for (double& value : t) value = time(generator);
  return t;
}

// Parameter sets: the default, other azimuths, other lengths.
std::vector<PlatformParameters> ParameterSets() {
  std::map<std::string, double> azimuths = DefaultParameters(), lengths = DefaultParameters();
  azimuths["theta_1"] = 110 * kDegree;
  azimuths["theta_2"] = 235 * kDegree;
  lengths["r_a"] = 7.9;
  lengths["L1"] = 4.9;
  lengths["L3"] = 2.35;
  lengths["L5"] = 2.45;
  lengths["s_r_so"] = 0.3;
  return {Default(), ParametersOf(azimuths), ParametersOf(lengths)};
}

TEST(Equation5, GivesThePoseThatClosesTheLoops) {
  for (const PlatformParameters& p : ParameterSets()) {
    for (double t : Instants()) {
      const PoseCommand c = SeaState(t);
      ParasiticMotion m;
      const Jet height{c.platform[2].value - c.heave.value, -c.heave.rate, -c.heave.acceleration};
      ASSERT_TRUE(ComputeParasiticMotion(p, c.roll, c.pitch, height, SignInM::kCorrected, &m).ok());
      const Vec3 q = ClosedPose(p, c);
      const double roundoff = 32 * kEps * p.r_b;  // products of a few factors near r_b
      EXPECT_NEAR(m.x.value, q.x(), roundoff);
      EXPECT_NEAR(m.y.value, q.y(), roundoff);
      EXPECT_NEAR(m.yaw.value, q.z(), 32 * kEps);
    }
  }
}

ParasiticMotion ParasiticAt(const PlatformParameters& p, const PoseCommand& c, SignInM sign) {
  ParasiticMotion m;
  const Jet &z = c.platform[2], &h = c.heave;
  const Jet height{z.value - h.value, z.rate - h.rate, z.acceleration - h.acceleration};
  EXPECT_TRUE(ComputeParasiticMotion(p, c.roll, c.pitch, height, sign, &m).ok());
  return m;
}

// The platform's height may move too: a case that the print leaves out.
PoseCommand SeaStateWithLift(double t) {
  PoseCommand c = SeaState(t);
  c.platform[2] = Evaluate(SineTerm{0.3, 0.2, 0.4}, t);
  c.platform[2].value += 3.5;
  return c;
}

TEST(Equations6And7, AreTheDerivativesOfTheClosedPose) {
  for (const PlatformParameters& p : ParameterSets()) {
    for (double t : Instants()) {
      auto pose = [&](double s) { return ClosedPose(p, SeaStateWithLift(s)); };
      const Vec3 rate = Rate(pose, t), acceleration = Acceleration(pose, t);
      const ParasiticMotion m = ParasiticAt(p, SeaStateWithLift(t), SignInM::kCorrected);
      const double size = p.r_b;  // of the terms that cancel in Newton's residuals
      EXPECT_NEAR(m.x.rate, rate.x(), RateLimit(size));
      EXPECT_NEAR(m.y.rate, rate.y(), RateLimit(size));
      EXPECT_NEAR(m.yaw.rate, rate.z(), RateLimit(1));
      EXPECT_NEAR(m.x.acceleration, acceleration.x(), AccelerationLimit(size));
      EXPECT_NEAR(m.y.acceleration, acceleration.y(), AccelerationLimit(size));
      EXPECT_NEAR(m.yaw.acceleration, acceleration.z(), AccelerationLimit(1));
    }
  }
}

TEST(Equations6And7, AreWrongWithThePrintedSignInM) {
  double rate_error = 0, acceleration_error = 0;
  for (int k = 0; k <= 60; ++k) {
    const double t = 0.2 * k;
    auto pose = [&](double s) { return ClosedPose(Default(), SeaState(s)); };
    const ParasiticMotion m = ParasiticAt(Default(), SeaState(t), SignInM::kPrinted);
    rate_error = std::max(rate_error, std::abs(m.x.rate - Rate(pose, t).x()));
    acceleration_error =
        std::max(acceleration_error, std::abs(m.x.acceleration - Acceleration(pose, t).x()));
  }
  EXPECT_NEAR(rate_error, 1.5e-2, 0.05e-2);
  EXPECT_NEAR(acceleration_error, 5.0e-2, 0.05e-2);
}

Pose PoseOf(const FrameMotion& m) {
  Pose X = Pose::Identity();
  X.linear() = m.R_EB;
  X.translation() = m.p_EB;
  return X;
}

PoseCommand TiltingPlatform(double t) {
  PoseCommand c = SeaState(t);
  for (int k = 0; k < 6; ++k) {
    c.platform[k] = Evaluate(SineTerm{k < 3 ? 0.2 : 0.04, 0.15 + 0.02 * k, 0.3 * k}, t);
  }
  c.platform[2].value += 3.5;
  return c;
}

TEST(Equations8To11, AreTheTwistsOfThePosesAndTheirDerivatives) {
  for (double t : Instants()) {
    auto lower = [](double s) {
      const PoseCommand c = SeaState(s);
      return LowerPlatformMotion(c.roll, c.pitch, c.heave, 0.225);
    };
    auto upper = [](double s) { return UpperPlatformMotion(TiltingPlatform(s).platform); };
    auto check = [&](auto motion) {
      auto pose = [&](double s) { return PoseOf(motion(s)); };
      const Vec6 V = TwistFromPoses(pose, t);
      EXPECT_LT((TwistOf(motion(t)) - V).cwiseAbs().maxCoeff(), RateLimit(4));
      auto twist = [&](double s) -> Vec6 { return TwistOf(motion(s)); };
      const Vec6 A = Rate(twist, t);
      EXPECT_LT((SpatialAccelerationOf(motion(t)) - A).cwiseAbs().maxCoeff(), RateLimit(4));
    };
    check(lower);
    check(upper);
  }
}

TEST(Equations12And13, GiveTheTwistOfTheRelativePoseAndItsDerivative) {
  auto relative = [](double s) {
    const PoseCommand c = TiltingPlatform(s);
    return ComputeRelativeMotion(LowerPlatformMotion(c.roll, c.pitch, c.heave, 0.225),
                                 UpperPlatformMotion(c.platform), 9.8);
  };
  double without_bracket = 0;
  for (double t : Instants()) {
    auto pose = [&](double s) {
      Pose X = Pose::Identity();
      X.linear() = relative(s).R_op;
      X.translation() = relative(s).p_op;
      return X;
    };
    const RelativeMotion m = relative(t);
    EXPECT_LT((m.V_op - TwistFromPoses(pose, t)).cwiseAbs().maxCoeff(), RateLimit(4));
    auto twist = [&](double s) -> Vec6 { return relative(s).V_op; };
    const Vec6 A = Rate(twist, t);
    EXPECT_LT((m.A_op - A).cwiseAbs().maxCoeff(), RateLimit(4));
    without_bracket = std::max(without_bracket, (m.A_ep - m.A_eo - A).cwiseAbs().maxCoeff());
  }
  EXPECT_GT(without_bracket, 1e-2);  // the bracket matters
}

TEST(Equations14To20, GiveTheLimbsOfTheClosedPose) {
  for (const PlatformParameters& p : ParameterSets()) {
    const PlatformEquations equations(p, DrivePairs::kSynchronous);
    for (double t : Instants()) {
      const Evaluation e = Evaluate(equations, SeaState(t));
      for (int i = 0; i < 3; ++i) {
        const ClosedLimb limb = CloseLimb(p, SeaState(t), i);
        const LimbMotion& m = e.limbs[i];
        // Near the toggle q2 changes by 1/(L3 |sin q2|) per metre.
        const double roundoff = 64 * kEps * p.r_a;
        const double angle = roundoff / std::abs(std::sin(limb.q2));
        EXPECT_NEAR(m.length.value, limb.l, roundoff);
        EXPECT_NEAR(m.tilt.value, limb.tilt, roundoff);
        EXPECT_NEAR(m.side[0].q1.value, limb.q1, angle);
        EXPECT_NEAR(m.side[0].q2.value, limb.q2, angle);
        EXPECT_NEAR(m.side[1].R.value, limb.R, angle * 3);
      }
    }
  }
}

TEST(Equations16To20, HaveTheRatesOfTheClosedPose) {
  const PlatformParameters& p = Default();
  const PlatformEquations equations(p, DrivePairs::kSynchronous);
  for (double t : Instants()) {
    const Evaluation e = Evaluate(equations, SeaState(t));
    for (int i = 0; i < 3; ++i) {
      auto limb = [&](double s) {
        const ClosedLimb c = CloseLimb(p, SeaState(s), i);
        Eigen::Matrix<double, 5, 1> v;
        v << c.l, c.tilt, c.q1, c.q2, c.R;
        return v;
      };
      const auto rate = Rate(limb, t);
      const auto acceleration = Acceleration(limb, t);
      const LimbMotion& m = e.limbs[i];
      const Jet jets[] = {m.length, m.tilt, m.side[0].q1, m.side[0].q2, m.side[0].R};
      const double size = p.r_a / std::abs(m.side[0].s2);
      for (int k = 0; k < 5; ++k) {
        EXPECT_NEAR(jets[k].rate, rate[k], RateLimit(size)) << "t = " << t << ", " << k;
        EXPECT_NEAR(jets[k].acceleration, acceleration[k], AccelerationLimit(size))
            << "t = " << t << ", " << k;
      }
    }
  }
}

std::array<LimbPlace, 3> Places(const PlatformParameters& p) {
  std::array<LimbPlace, 3> places;
  for (int i = 0; i < 3; ++i) places[i] = LimbPlace(p.azimuth(i), p.r_a, p.r_b);
  return places;
}

TEST(Equation16, GivesTheRatesOfTheShortForm) {
  const PlatformEquations equations(Default(), DrivePairs::kSynchronous);
  for (double t : Instants()) {
    const Evaluation e = Evaluate(equations, SeaState(t));
    const InfluenceMatrices influence = ComputeInfluence(Places(Default()), e.limbs);
    const EquivalentRates q = RatesOf(influence, e.motion.V_op, e.motion.A_op);
    for (int i = 0; i < 3; ++i) {
      const Vec3 u = e.limbs[i].R_oA.col(2);
      Vec6 row;
      row << e.limbs[i].p_oB.cross(u), u;
      EXPECT_LT((influence.G.row(i).transpose() - row).norm(), 256 * kEps * 8);
      EXPECT_NEAR(q.rate[i], e.limbs[i].length.rate, 256 * kEps * 16);
      EXPECT_NEAR(q.acceleration[i], e.limbs[i].length.acceleration, 4096 * kEps * 16);
      EXPECT_NEAR(q.rate[3 + i], 0, 256 * kEps * 16);
      EXPECT_NEAR(q.acceleration[3 + i], 0, 4096 * kEps * 16);
    }
  }
}

TEST(Equations1And2, SpanTheSameMotionsUpToTheLoop) {
  const Evaluation e =
      Evaluate(PlatformEquations(Default(), DrivePairs::kSynchronous), SeaState(1.5));
  const LimbGeometry& g = e.geometry[1];
  const double c3 = e.limbs[1].length.value;
  const auto screws = LimbScrews(2.5, g.E[0].y(), g.E[0].z(), c3);
  const auto equivalent = EquivalentScrews(c3);
  // Chain 1: $1…$6. The only wrench reciprocal to (2) is a force along Y through B.
  Eigen::Matrix<double, 6, 5> E;
  for (int k = 0; k < 5; ++k) E.col(k) = equivalent[k];
  EXPECT_EQ((E.colPivHouseholderQr().rank()), 5);
  Vec6 force_along_Y;  // [m; f]
  force_along_Y << Vec3(0, 0, c3).cross(Vec3::UnitY()), Vec3::UnitY();
  for (const Vec6& screw : equivalent) EXPECT_EQ(force_along_Y.dot(screw), 0);
  // The elbow R12 of the print lies on the far side: link 1 crosses the Z axis.
  EXPECT_GT(g.E[0].y(), 0);
  EXPECT_LT(g.E[1].y(), 0);
  // Chain $1…$6 has rank 6, and the five-bar (X rotations and Y twice) rank 4.
  Mat6 chain;
  for (int k = 0; k < 6; ++k) chain.col(k) = screws[k];
  EXPECT_EQ(chain.colPivHouseholderQr().rank(), 6);
  Eigen::Matrix<double, 6, 7> loop;
  const int members[] = {0, 1, 2, 3, 6, 7, 8};
  for (int k = 0; k < 7; ++k) loop.col(k) = screws[members[k]];
  EXPECT_EQ((loop.colPivHouseholderQr().rank()), 4);
}

}  // namespace
}  // namespace mbv::stabilizing_platform
