#include "analytic/stabilizing_platform/platform_wrench.h"

#include <fmt/format.h>

#include "core/spatial.h"

namespace mbv::stabilizing_platform {
namespace {

// Of the platform with its load, in {o}.
Vec3 CentreOfMass(const PlatformParameters& p, const RelativeMotion& motion) {
  return motion.p_op + motion.R_op * p.c_p;
}

}  // namespace

Vec6 InertiaWrench(const PlatformParameters& p, const RelativeMotion& motion) {
  const Mat3 I_o = motion.R_op * p.I_p.asDiagonal() * motion.R_op.transpose();
  const Mat6 N = SpatialInertia(p.m_p, CentreOfMass(p, motion), I_o);
  const Vec6 momentum = N * motion.V_ep;
  // ad(V)ᵀ h = −(ω × m + v × f ; ω × f) for h = (m ; f).
  const auto omega = motion.V_ep.head<3>(), v = motion.V_ep.tail<3>();
  Vec6 W = -(N * motion.A_ep);
  W.head<3>() -= omega.cross(momentum.head<3>()) + v.cross(momentum.tail<3>());
  W.tail<3>() -= omega.cross(momentum.tail<3>());
  return W;
}

Vec6 GravityWrench(const PlatformParameters& p, const RelativeMotion& motion) {
  Vec6 W;
  const Vec3 weight = p.m_p * motion.gravity;
  W << CentreOfMass(p, motion).cross(weight), weight;
  return W;
}

RunSummary SolvePlatform(const PlatformParameters& p, const RelativeMotion& motion,
                         const std::array<LimbMotion, 3>& limbs, const Vec3& f_X, const Vec6& load,
                         Vec6* f) {
  // (21)
  Mat6 S;
  Vec6 W = -GravityWrench(p, motion) - InertiaWrench(p, motion) - load;
  for (int i = 0; i < 3; ++i) {
    const LimbMotion& limb = limbs[i];
    const auto X = limb.R_oA.col(0), Y = limb.R_oA.col(1), Z = limb.R_oA.col(2);
    S.col(i) << limb.p_oB.cross(Z), Z;
    S.col(3 + i) << limb.p_oB.cross(Y), Y;
    W.head<3>() -= f_X[i] * limb.p_oB.cross(X);
    W.tail<3>() -= f_X[i] * X;
  }
  const Eigen::PartialPivLU<Mat6> lu(S);
  const auto pivots = lu.matrixLU().diagonal().cwiseAbs();
  const double smallest = pivots.minCoeff() / pivots.maxCoeff();
  if (!(smallest > 1e-10)) {
    return {.stop = Stop::kSingular,
            .message = fmt::format("the six limb forces on the platform are dependent: pivot "
                                   "ratio {:.3g}",
                                   smallest),
            .where = "platform",
            .amount = smallest,
            .unit = "1"};
  }
  *f = lu.solve(W);
  return RunSummary::Done();
}

}  // namespace mbv::stabilizing_platform
