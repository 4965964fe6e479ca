// The 3-SPR mechanism's velocities, accelerations and forces: home pose by hand, a tabulated
// general pose, then laws (differences along motions, virtual power, Newton–Euler, energy).
#include "analytic/spr_tripod/dynamics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <type_traits>

#include "math/spatial.h"
#include "tests/analytic/spr_tripod_model.h"

namespace mbv::spr_tripod {
namespace {

using std::numbers::pi;

constexpr double kDegDynamics = pi / 180.0;
constexpr double kGravity = 9.81;

// Everything at one instant.
struct State {
  Posture p;
  Jacobians j;
  Velocities v;
  Accelerations a;
  Forces f;
};

State StateAt(const Geometry& g, const Masses& masses, const Vec3& r, const Vec3& v,
              const Vec3& v_dot, const ExternalLoads& loads = {}) {
  State s;
  EXPECT_TRUE(SolveInverse(g, r, &s.p).ok());
  EXPECT_TRUE(FillJacobians(g, s.p, &s.j).ok());
  FillVelocities(s.p, s.j, v, &s.v);
  FillAccelerations(s.p, s.j, s.v, v_dot, &s.a);
  FillForces(s.p, s.j, s.v, s.a, masses, loads, &s.f);
  return s;
}

State GeneralState() {
  const Vec3 r =
      CentreOf(PaperGeometry(), Tilt::FromEuler(40 * kDegDynamics, 15 * kDegDynamics), 0.55);
  return StateAt(PaperGeometry(), DefaultMasses(), r, {0.3, -0.2, 0.1}, {1, 2, -3});
}

// Lateral offsets, full inertia matrices and inclined gravity: nothing symmetric is left.
Masses SkewMasses() {
  Masses m = DefaultMasses();
  m.gravity = {1.5, -2.0, 9.0};
  m.platform.com = {0.03, -0.02, 0.05};
  m.cylinder.com = {0.01, -0.02, 0.15};
  m.rod.com = {-0.015, 0.025, -0.18};
  m.platform.I = Vec3(0.3, 0.4, 0.6).asDiagonal();
  m.platform.I(0, 1) = m.platform.I(1, 0) = 0.02;
  m.cylinder.I = Vec3(0.08, 0.09, 0.02).asDiagonal();
  m.cylinder.I(0, 2) = m.cylinder.I(2, 0) = 0.004;
  m.rod.I = Vec3(0.05, 0.06, 0.02).asDiagonal();
  return m;
}

ExternalLoads ToolLoad(const Posture& p) {
  ExternalLoads loads;
  loads.Add(kPlatform, p.R * Vec3(0, 0, 0.20), {120, -80, -400}, {3, -5, 8});
  loads.Add(RodBody(1), Vec3(0.01, 0.02, -0.1), {5, -7, 11}, {0.1, 0.2, -0.3});
  return loads;
}

// A motion that visits a good part of the workspace; exact derivatives.
struct Path {
  Vec3 r(double t) const {
    return {0.05 + 0.08 * std::sin(3 * t), 0.07 * std::sin(4 * t + 1),
            0.57 + 0.05 * std::cos(5 * t)};
  }
  Vec3 v(double t) const {
    return {0.24 * std::cos(3 * t), 0.28 * std::cos(4 * t + 1), -0.25 * std::sin(5 * t)};
  }
  Vec3 v_dot(double t) const {
    return {-0.72 * std::sin(3 * t), -1.12 * std::sin(4 * t + 1), -1.25 * std::cos(5 * t)};
  }
  State At(double t, const Masses& masses = SkewMasses(), bool loaded = false) const {
    State s = StateAt(PaperGeometry(), masses, r(t), v(t), v_dot(t));
    if (loaded) FillForces(s.p, s.j, s.v, s.a, masses, ToolLoad(s.p), &s.f);
    return s;
  }
};

// Sixth-order central difference. With h = 2 ms, |d⁷/dt⁷| < 5⁷ per unit: truncation
// h⁶ 5⁷/140 = 4e-14, rounding 11 ε/(6 h) = 2e-13; kDifference covers 50 quantities of size < 5.
constexpr double kStep_s = 2e-3;
constexpr double kDifference = 1e-11;
template <typename F>
std::invoke_result_t<F, double> Difference(F f, double t) {
  constexpr double h = kStep_s;
  return ((45 * (f(t + h) - f(t - h)) - 9 * (f(t + 2 * h) - f(t - 2 * h)) +
           (f(t + 3 * h) - f(t - 3 * h))) /
          (60 * h));
}

TEST(SprTripodVelocity, HomePoseTiltsAboutTheHorizontalNormalOfTheVelocity) {
  const double z = 0.57, q = std::hypot(0.245, z);
  const Vec3 v(0.3, -0.2, 0.1);
  const State s = StateAt(PaperGeometry(), DefaultMasses(), {0, 0, z}, v, Vec3::Zero());
  EXPECT_LT((s.v.omega - Vec3::UnitZ().cross(v) / z).norm(), 20 * kEps);
  for (int i = 0; i < 3; ++i) {
    const Vec3 f = PaperGeometry().f[i];
    EXPECT_NEAR(s.v.q_dot[i], (z * v.z() - 0.455 * f.dot(v)) / q, 20 * kEps);
  }
  const double k = 1.5 * std::sqrt(3.0) * 0.455 * z;
  EXPECT_NEAR(s.j.det, k * 0.455 / (q * q * q), 50 * kEps);
  EXPECT_NEAR(std::abs(s.j.det_c), k * z, 50 * kEps);
}

TEST(SprTripodVelocity, HomeDeterminantsMatchTabulatedValuesAtShortestLegs) {
  const double z = std::sqrt(0.25 - 0.245 * 0.245);
  const State s = StateAt(PaperGeometry(), DefaultMasses(), {0, 0, z}, Vec3::Zero(), Vec3::Zero());
  EXPECT_NEAR(s.j.det, 1.875482, 5e-7);
  EXPECT_NEAR(std::abs(s.j.det_c), 0.224574, 5e-7);
}

TEST(SprTripodVelocity, VerticalMotionHasThePlaneTriangleAcceleration) {
  const double z = 0.6, vz = 0.4, az = 1.5, q = std::hypot(0.245, z);
  const State s = StateAt(PaperGeometry(), DefaultMasses(), {0, 0, z}, {0, 0, vz}, {0, 0, az});
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(s.a.q_ddot[i], z * az / q + vz * vz * 0.245 * 0.245 / (q * q * q), 50 * kEps);
  }
}

TEST(SprTripodDynamics, HomePoseHoldsItsWeightByTheStaticFormula) {
  const double z = 0.57, q = std::hypot(0.245, z), k = 0.245 * 0.245 / (q * q * q);
  const State s = StateAt(PaperGeometry(), DefaultMasses(), {0, 0, z}, Vec3::Zero(), Vec3::Zero());
  const double f = -q / (3 * z) * kGravity * (30 + 3 * 4 * (1 - 0.18 * k) + 3 * 6 * 0.15 * k);
  EXPECT_NEAR(q, 0.6204232426336, 6e-14);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(s.f.f[i], f, 1e-12);
    EXPECT_NEAR(s.f.f[i], -149.972431679261, 1e-11);
    EXPECT_NEAR(s.f.S[i].z(), -588.6 / 3, 1e-11);
  }
  // 1 % more platform is seen.
  Masses heavier = DefaultMasses();
  heavier.platform.mass *= 1.01;
  const State h = StateAt(PaperGeometry(), heavier, {0, 0, z}, Vec3::Zero(), Vec3::Zero());
  EXPECT_GT(std::abs(h.f.f[0] - f), 0.5);
}

TEST(SprTripodDynamics, GeneralStateMatchesTabulatedValues) {
  const State s = GeneralState();
  const auto expect = [](const Vec3& actual, const Vec3& tabulated, double tolerance) {
    EXPECT_LT((actual - tabulated).cwiseAbs().maxCoeff(), tolerance)
        << actual.transpose() << " against " << tabulated.transpose();
  };
  const auto vec = [](const PerLeg<double>& x) { return Vec3(x[0], x[1], x[2]); };
  constexpr double kTable = 2e-13;  // 13 decimals printed
  expect(vec(s.v.q_dot), {0.3767360357474, 0.1497982994607, -0.0446012201923}, kTable);
  expect(vec(s.a.q_ddot), {-3.2561743710981, -1.1940738385573, -3.6260442804258}, kTable);
  expect(s.v.omega, {0.3642024001887, 0.4821856268288, 0.017808742584}, kTable);
  expect(s.a.omega_dot, {-2.5554738074511, 1.9791750181461, 0.415859028352}, kTable);
  expect(s.v.omega_leg[0], {0.0980650287271, 0.3264543034267, 0.0316811930429}, kTable);
  expect(s.a.omega_leg_dot[0], {-0.8989483558131, 2.9331684064352, 0.4016155168475}, kTable);
  expect(vec(s.f.f), {-127.525396142175, -140.041348371558, -312.417078548095}, 1e-11);
  expect(s.f.S[0], {-16.3146233303746, 70.992607711643, -166.9800346342791}, 1e-11);
  const Mat3 M = TaskSpaceMass(s.p, s.j, DefaultMasses());
  expect(M.row(0), {45.8754081360672, -0.5125629726769, -0.9270165529356}, kTable);
}

TEST(SprTripodDynamics, MassMatrixAtHomeMatchesTabulatedValues) {
  const State s =
      StateAt(PaperGeometry(), DefaultMasses(), {0, 0, 0.57}, Vec3::Zero(), Vec3::Zero());
  const Mat3 M = TaskSpaceMass(s.p, s.j, DefaultMasses());
  const Vec3 tabulated(46.4818284313699, 46.4818284313699, 41.4022796074122);
  EXPECT_LT((M - Mat3(tabulated.asDiagonal())).cwiseAbs().maxCoeff(), 2e-13 * 46);
}

TEST(SprTripodDynamics, StaticForcesAtThePathsCornersMatchTabulatedValues) {
  struct Row {
    Vec3 r;
    double f12, f3;
  };
  for (const Row& row :
       {Row{{-0.12, 0, 0.54}, -187.10942, -70.19888}, Row{{-0.12, 0, 0.60}, -184.62622, -69.02417},
        Row{{0.12, 0, 0.60}, -108.70258, -220.86831},
        Row{{0.12, 0, 0.54}, -110.70798, -223.02576}}) {
    const State s = StateAt(PaperGeometry(), DefaultMasses(), row.r, Vec3::Zero(), Vec3::Zero());
    EXPECT_NEAR(s.f.f[0], row.f12, 6e-6);
    EXPECT_NEAR(s.f.f[1], row.f12, 6e-6);
    EXPECT_NEAR(s.f.f[2], row.f3, 6e-6);
  }
}

TEST(SprTripodVelocity, RatesAreDifferencesOfPositions) {
  const Path path;
  for (double t : {0.1, 0.7, 1.3, 2.2}) {
    const State s = path.At(t);
    const Vec3 q_dot = Difference(
        [&](double u) { return Vec3(Eigen::Map<const Vec3>(path.At(u).p.q.data())); }, t);
    const Mat3 R_dot = Difference([&](double u) { return Mat3(path.At(u).p.R); }, t);
    EXPECT_LT((R_dot - Skew(s.v.omega) * s.p.R).norm(), kDifference);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(s.v.q_dot[i], q_dot[i], kDifference);
      const Mat3 R_leg = Difference([&](double u) { return LegRotation(path.At(u).p, i); }, t);
      EXPECT_LT((R_leg - Skew(s.v.omega_leg[i]) * LegRotation(s.p, i)).norm(), kDifference);
      EXPECT_LT((LegJacobian(s.p, s.j, i) * s.v.v - s.v.omega_leg[i]).norm(), 100 * kEps);  // (20c)
    }
    EXPECT_LT((s.j.J * s.v.v - q_dot).norm(), kDifference);
  }
}

TEST(SprTripodVelocity, AccelerationsAreDifferencesOfVelocities) {
  const Path path;
  for (double t : {0.1, 0.7, 1.3, 2.2}) {
    const State s = path.At(t);
    const Vec3 omega_dot = Difference([&](double u) { return Vec3(path.At(u).v.omega); }, t);
    EXPECT_LT((s.a.omega_dot - omega_dot).norm(), kDifference);
    for (int i = 0; i < 3; ++i) {
      const double q_ddot = Difference([&](double u) { return path.At(u).v.q_dot[i]; }, t);
      EXPECT_NEAR(s.a.q_ddot[i], q_ddot, kDifference);
      const Vec3 a_A = Difference([&](double u) { return Vec3(path.At(u).v.v_A[i]); }, t);
      EXPECT_LT((s.a.a_A[i] - a_A).norm(), kDifference);
      const Vec3 leg = Difference([&](double u) { return Vec3(path.At(u).v.omega_leg[i]); }, t);
      EXPECT_LT((s.a.omega_leg_dot[i] - leg).norm(), kDifference);
      // Left out, the Coriolis part of (D6) would be seen.
      EXPECT_GT(2.0 * std::abs(s.v.q_dot[i]) * s.v.omega_leg[i].norm() / s.p.q[i],
                1e3 * kDifference);
    }
  }
}

TEST(SprTripodVelocity, PlatformAngularVelocityIsThatOfAConstantVelocityJoint) {
  const Path path;
  for (double t = 0.0; t < 2.0; t += 0.1) {
    const State s = path.At(t);
    EXPECT_NEAR(s.v.omega.dot(Vec3::UnitZ() + s.p.R.col(2)), 0.0, 50 * kEps);
    EXPECT_NEAR(s.p.R(1, 0), s.p.R(0, 1), 2 * kEps);
    EXPECT_NEAR(s.p.R(0, 2), -s.p.R(2, 0), 2 * kEps);
    EXPECT_NEAR(s.p.R(1, 2), -s.p.R(2, 1), 2 * kEps);
  }
}

// Wrench about O_B that the motion of all bodies asks for, from momenta differenced in time: no
// acceleration formula enters.
Vec6 MomentumRate(const Path& path, const Masses& masses, double t) {
  const auto momentum = [&](double u) {
    const State s = path.At(u, masses);
    Vec6 h = Vec6::Zero();
    for (int body = 0; body < kBodies; ++body) {
      const int leg = LegOf(body);
      const Inertia& inertia = InertiaOf(masses, body);
      const Pose X = BodyPose(s.p, body);
      const Vec3 omega = leg < 0 ? s.v.omega : s.v.omega_leg[leg];
      Vec3 v_G = omega.cross(X.linear() * inertia.com);
      if (leg < 0) v_G += s.v.v;
      if (body >= RodBody(0)) v_G += s.v.v_A[leg];
      const Vec3 G = X * inertia.com, p = inertia.mass * v_G;
      h.head<3>() += X.linear() * inertia.I * X.linear().transpose() * omega + G.cross(p);
      h.tail<3>() += p;
    }
    return h;
  };
  return Difference(momentum, t);
}

TEST(SprTripodDynamics, BaseReactionsBalanceTheMomentumOfAllBodies) {
  const Path path;
  const Masses masses = SkewMasses();
  for (double t : {0.1, 0.7, 1.3, 2.2}) {
    const State s = path.At(t, masses, true);
    const ExternalLoads loads = ToolLoad(s.p);
    Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
      force += s.f.S[i];
      moment += s.p.b[i].cross(s.f.S[i]);
    }
    for (int body = 0; body < kBodies; ++body) {
      const Inertia& inertia = InertiaOf(masses, body);
      const Pose X = BodyPose(s.p, body);
      const Vec3 weight = inertia.mass * masses.gravity;
      force += weight + loads.force[body];
      moment += (X * inertia.com).cross(weight) + X.translation().cross(loads.force[body]) +
                loads.moment[body];
    }
    const Vec6 rate = MomentumRate(path, masses, t);
    // 60 kg move: the difference's rounding times mass.
    EXPECT_LT((force - rate.tail<3>()).norm(), 60 * kDifference);
    EXPECT_LT((moment - rate.head<3>()).norm(), 60 * kDifference);
  }
}

TEST(SprTripodDynamics, BothWaysToTheDriveForceAgree) {
  const Path path;
  for (double t = 0.0; t < 2.0; t += 0.05) {
    const State s = path.At(t, SkewMasses(), true);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(s.f.f[i], s.f.f_check[i], 1e4 * kEps * 600);  // cond J < 2.2, sums of 600 N
    }
  }
}

TEST(SprTripodDynamics, DrivePowerIsTheRateOfEnergy) {
  const Path path;
  const Masses masses = SkewMasses();
  for (double t : {0.1, 0.7, 1.3, 2.2}) {
    const State s = path.At(t, masses);
    double power = 0.0;
    for (int i = 0; i < 3; ++i) power += s.f.f[i] * s.v.q_dot[i];
    const auto energy = [&](double u) {
      const State state = path.At(u, masses);
      return Energy(state.p, state.v, masses);
    };
    const double rate = Difference(energy, t);
    EXPECT_NEAR(power, rate, 600 * kDifference);  // energies of some 300 J
    // A wrong sign in one leg would be seen.
    EXPECT_GT(std::abs(2 * s.f.f[0] * s.v.q_dot[0]), 1e3 * 600 * kDifference);
  }
}

TEST(SprTripodDynamics, TaskSpaceMassGivesTheForceOfAnAccelerationFromRest) {
  const Path path;
  const Masses masses = SkewMasses();
  const Vec3 v_dot(1, 2, -3);
  for (double t : {0.1, 0.7, 1.3}) {
    const State rest = StateAt(PaperGeometry(), masses, path.r(t), Vec3::Zero(), Vec3::Zero());
    const State moved = StateAt(PaperGeometry(), masses, path.r(t), Vec3::Zero(), v_dot);
    const Mat3 M = TaskSpaceMass(rest.p, rest.j, masses);
    EXPECT_LT((M - M.transpose()).norm(), 100 * kEps * M.norm());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat3>(M).eigenvalues()[0], 30.0);
    Vec3 difference;
    for (int i = 0; i < 3; ++i) difference[i] = moved.f.f[i] - rest.f.f[i];
    EXPECT_LT((rest.j.J.transpose() * difference - M * v_dot).norm(), 1e4 * kEps * 600);
    // Kinetic energy is the same quadratic form.
    Velocities v;
    FillVelocities(rest.p, rest.j, v_dot, &v);
    const double kinetic = Energy(rest.p, v, masses) - Energy(rest.p, rest.v, masses);
    EXPECT_NEAR(kinetic, 0.5 * v_dot.dot(M * v_dot), 1e4 * kEps * 300);
  }
}

// (D11) written as its nine equations and solved as such.
TEST(SprTripodDynamics, BaseReactionsSolveTheNineBalanceEquations) {
  const Path path;
  const Masses masses = SkewMasses();
  const State s = path.At(0.7, masses, true);
  const ExternalLoads loads = ToolLoad(s.p);
  Eigen::Matrix<double, 9, 9> A = Eigen::Matrix<double, 9, 9>::Zero();
  Eigen::Matrix<double, 9, 1> rhs = Eigen::Matrix<double, 9, 1>::Zero();
  for (int i = 0; i < 3; ++i) {
    A.block<3, 3>(0, 3 * i) = Mat3::Identity();
    A.block<3, 3>(3, 3 * i) = Skew(s.p.b[i]);
    A.block<1, 3>(6 + i, 3 * i) = s.p.c[i].cross(-s.p.q[i] * s.p.w[i]).transpose();
  }
  for (int body = 0; body < kBodies; ++body) {
    const int leg = LegOf(body);
    const Inertia& inertia = InertiaOf(masses, body);
    const Pose X = BodyPose(s.p, body);
    const Mat3 I = X.linear() * inertia.I * X.linear().transpose();
    const Vec3 omega = leg < 0 ? s.v.omega : s.v.omega_leg[leg];
    const Vec3 alpha = leg < 0 ? s.a.omega_dot : s.a.omega_leg_dot[leg];
    const Vec3 rho = X.linear() * inertia.com;
    Vec3 a_G = alpha.cross(rho) + omega.cross(omega.cross(rho));
    if (leg < 0) a_G += s.a.v_dot;
    if (body >= RodBody(0)) a_G += s.a.a_A[leg];
    const Vec3 F = inertia.mass * (a_G - masses.gravity);
    const Vec3 N = I * alpha + omega.cross(I * omega);
    const Vec3 G = X * inertia.com, O = X.translation();
    rhs.segment<3>(0) += F - loads.force[body];
    rhs.segment<3>(3) += G.cross(F) + N - O.cross(loads.force[body]) - loads.moment[body];
    if (leg < 0) continue;
    const Vec3 A_i = s.p.r + s.p.a[leg];
    rhs[6 + leg] += s.p.c[leg].dot((G - A_i).cross(F) + N - (O - A_i).cross(loads.force[body]) -
                                   loads.moment[body]);
  }
  const Eigen::Matrix<double, 9, 1> S = A.partialPivLu().solve(rhs);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT((S.segment<3>(3 * i) - s.f.S[i]).norm(), 1e4 * kEps * 600);
  }
}

}  // namespace
}  // namespace mbv::spr_tripod
