// Stabilizing platform: required wrenches of the links as rates of momentum of their poses, and the
// limb's forces by the paper's 30 equations as a second route.
#include <gtest/gtest.h>

#include <algorithm>

#include "analytic/stabilizing_platform/dynamics.h"
#include "tests/analytic/stabilizing_platform_differences.h"
#include "tests/analytic/stabilizing_platform_fixture.h"

namespace mbv::stabilizing_platform {
namespace {

// Pose of a link's frame in the earth frame.
Pose LinkPose(const PlatformEquations& equations, double t, int limb, int link) {
  Evaluation e;
  const RunSummary summary = equations.EvaluateKinematics(SeaState(t), &e);
  EXPECT_TRUE(summary.ok()) << summary.message;
  const LimbGeometry g = GeometryOf(equations.parameters(), e.limbs[limb]);
  Pose X = Pose::Identity();
  X.linear() = e.lower.R_EB * e.limbs[limb].R_oA * g.R_AL(link);
  X.translation() =
      e.lower.p_EB + e.lower.R_EB * (e.limbs[limb].p_oA + e.limbs[limb].R_oA * g.origin(link));
  return X;
}

// Required wrench about the earth's origin = rate of momentum − gravity, from poses alone.
Vec6 WrenchFromPoses(const PlatformParameters& p, const LinkInertia& link, double com_y,
                     const std::function<Pose(double)>& X, double t) {
  auto momentum = [&](double s) -> Vec6 {
    const Vec6 V = TwistFromPoses(X, s);
    const Pose X_s = X(s);
    const Vec3 c = X_s * Vec3(0, com_y, 0);
    const Vec3 f = link.mass * (V.tail<3>() + V.head<3>().cross(c));
    const Mat3 I = X_s.linear() * link.moments.asDiagonal() * X_s.linear().transpose();
    Vec6 h;
    h << I * V.head<3>() + c.cross(f), f;
    return h;
  };
  Vec6 W = Rate(momentum, t);
  const Vec3 weight(0, 0, -p.g * link.mass), c = X(t) * Vec3(0, com_y, 0);
  W.head<3>() -= c.cross(weight);
  W.tail<3>() -= weight;
  return W;
}

void CheckRequiredWrenches(DrivePairs pairs) {
  const PlatformParameters& p = Default();
  const PlatformEquations equations(p, pairs);
  for (double t : {0.3, 1.5, 7.3}) {
    const Evaluation e = Evaluate(equations, SeaState(t));
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 4; ++k) {
        auto pose = [&](double s) { return LinkPose(equations, s, i, k); };
        const double length = k < kLink2 ? p.L1 : p.L3;
        const Vec6 expected =
            WrenchFromPoses(p, p.links[k], p.links[k].com_fraction * length, pose, t);
        // From {A_i} to the earth's origin.
        const Mat3 R_eA = e.lower.R_EB * e.limbs[i].R_oA;
        const Vec3 p_eA = e.lower.p_EB + e.lower.R_EB * e.limbs[i].p_oA;
        Vec6 got;
        got.tail<3>() = R_eA * e.required[i][k].tail<3>();
        got.head<3>() = R_eA * e.required[i][k].head<3>() + p_eA.cross(got.tail<3>());
        // Momenta of 2e4 kg m/s · 8 m carry differences of differences of poses.
        EXPECT_LT((got - expected).cwiseAbs().maxCoeff(), 2e-3)
            << "t = " << t << ", limb " << i + 1 << ", " << kLinkNames[k];
      }
    }
  }
}

TEST(LinkWrenches, AreTheRatesOfMomentumOfSynchronousLimbs) {
  CheckRequiredWrenches(DrivePairs::kSynchronous);
}
TEST(LinkWrenches, AreTheRatesOfMomentumOfIndependentLimbs) {
  CheckRequiredWrenches(DrivePairs::kIndependent);
}

TEST(LimbSystem, OfThePrintHasRank28AndIsInconsistent) {
  for (int k = 0; k < 48; ++k) {
    const Evaluation e =
        Evaluate(PlatformEquations(Default(), DrivePairs::kSynchronous), SeaState(0.25 * k));
    for (int i = 0; i < 3; ++i) {
      const LimbSystem printed = MakeLimbSystem(LimbSystemForm::kPrinted, e.geometry[i],
                                                e.required[i], e.f[3 + i], e.f[i]);
      const auto sigma = ColumnScaledSingularValues(printed);
      EXPECT_GE(sigma[27], 0.04);
      EXPECT_LT(sigma[28], 1e-14);
      // No solution once links have mass.
      const Eigen::MatrixXd A = printed.matrix;
      const Eigen::VectorXd x = A.completeOrthogonalDecomposition().solve(printed.right_side);
      EXPECT_GT((A * x - printed.right_side).norm(), 1);  // N, N m
    }
  }
}

TEST(LimbSystem, CorrectedIsRegularAndAgreesWithTheClosedForm) {
  double worst_condition = 0;
  for (int k = 0; k < 240; ++k) {
    const Evaluation e =
        Evaluate(PlatformEquations(Default(), DrivePairs::kSynchronous), SeaState(0.05 * k));
    for (int i = 0; i < 3; ++i) {
      const LimbSystem system = MakeLimbSystem(LimbSystemForm::kCorrected, e.geometry[i],
                                               e.required[i], e.f[3 + i], e.f[i]);
      const auto sigma = ColumnScaledSingularValues(system);
      worst_condition = std::max(worst_condition, sigma[0] / sigma[29]);
      const LimbSystemSolution solved = SolveLimbSystem(system, e.f[3 + i], e.f[i]);
      const LimbReactions closed = ReactionsOf(e.geometry[i], e.required[i], e.forces[i]);
      const double limit = 1e4 * kEps * 1.2e6;  // forces up to 1.2 MN, condition 39, 30 unknowns
      EXPECT_NEAR(solved.tau_X, 0, limit);
      EXPECT_NEAR(solved.forces.on_platform.x(), e.f_X[i], limit);
      for (int j = 0; j < 2; ++j) {
        EXPECT_NEAR(solved.forces.drive[j], e.forces[i].drive[j], limit);
        EXPECT_LT((solved.forces.P[j] - e.forces[i].P[j]).norm(), limit);
        EXPECT_LT((solved.reactions.elbow[j] - closed.elbow[j]).norm(), limit);
        EXPECT_LT((solved.reactions.foot[j] - closed.foot[j]).norm(), limit);
      }
    }
  }
  EXPECT_LE(worst_condition, 39);
}

TEST(LimbSystem, NoticesAWrenchPerturbedByItsTolerance) {
  Evaluation e = Evaluate(PlatformEquations(Default(), DrivePairs::kSynchronous), SeaState(1.5));
  const double limit = 1e4 * kEps * 1.2e6;
  e.required[1][kLink1][0] += 20 * limit;  // N m at an arm of 3 m
  const LimbSystem system =
      MakeLimbSystem(LimbSystemForm::kCorrected, e.geometry[1], e.required[1], e.f[4], e.f[1]);
  const LimbSystemSolution solved = SolveLimbSystem(system, e.f[4], e.f[1]);
  EXPECT_GT(std::abs(solved.forces.drive[0] - e.forces[1].drive[0]), limit);
}

}  // namespace
}  // namespace mbv::stabilizing_platform
