#include "analytic/scara_robot/velocity.h"

#include <fmt/format.h>

#include <numbers>

namespace mbv::scara_robot {
namespace {

Mat34 PlatformPoint(const Vec3& k) {
  Mat34 R;
  R << Mat3::Identity(), k;
  return R;
}

}  // namespace

Mat4 DirectJacobian(const Position& position) {
  Mat4 J_theta;
  for (int i = 0; i < kLimbs; ++i) {
    J_theta.row(i) << position.eta[i].transpose(), position.eta[i].dot(position.k[i]);
  }
  return J_theta;
}

Vec4 InverseJacobian(const Parameters& parameters, const Position& position) {
  return parameters.l1 * position.V;
}

Mat4 AccelerationForm(const Parameters& parameters, const Position& position, int limb) {
  const Vec3& eta = position.eta[limb];
  const Vec3& n = position.n[limb];
  const double V = position.V[limb], l1 = parameters.l1;
  const Mat34 R = PlatformPoint(position.k[limb]);
  const Vec4 R_eta = R.transpose() * eta;
  const Mat34 PR = R - n * R_eta.transpose() / V;
  Mat4 form = eta.dot(position.u[limb]) / (V * V) * R_eta * R_eta.transpose() +
              l1 / parameters.rod_length(limb) * PR.transpose() * PR;
  form(3, 3) -= l1 * eta.dot(position.s[limb]);
  return form / V;
}

Vec4 VelocityProduct(const Parameters& parameters, const Position& position, const Vec4& dX) {
  Vec4 f;
  for (int i = 0; i < kLimbs; ++i) {
    f[i] = dX.dot(AccelerationForm(parameters, position, i) * dX) / (parameters.l1 * parameters.l1);
  }
  return f;
}

void DriveRates(const Parameters& parameters, const Position& position, Rates* rates) {
  const Mat4 J_theta = DirectJacobian(position);
  const Vec4 J_x = InverseJacobian(parameters, position);
  rates->dtheta = (J_theta * rates->dX).cwiseQuotient(J_x);
  rates->ddtheta =
      (J_theta * rates->ddX).cwiseQuotient(J_x) + VelocityProduct(parameters, position, rates->dX);
}

void PlatformRates(const Parameters& parameters, const Position& position, Rates* rates) {
  const Eigen::PartialPivLU<Mat4> J_theta(DirectJacobian(position));
  const Vec4 J_x = InverseJacobian(parameters, position);
  rates->dX = J_theta.solve(J_x.cwiseProduct(rates->dtheta));
  const Vec4 f = VelocityProduct(parameters, position, rates->dX);
  rates->ddX = J_theta.solve(J_x.cwiseProduct(rates->ddtheta - f));
}

Singularity Measure(const Parameters& parameters, const Position& position) {
  Mat4 scaled = DirectJacobian(position);
  scaled.col(3) /= parameters.r;
  Singularity result;
  result.s_min = Eigen::JacobiSVD<Mat4>(scaled).singularValues()[3];
  result.det = scaled.determinant();
  result.V_min = (parameters.branch * position.V).minCoeff(&result.dead_limb);
  return result;
}

RunSummary CheckRegular(const Position& position, const Singularity& singularity) {
  const bool dead_point = singularity.V_min < kRankDeficient;
  if (!dead_point && singularity.s_min >= kRankDeficient) return RunSummary::Done();
  const Vec4& X = position.X;
  RunSummary summary;
  summary.stop = Stop::kSingular;
  summary.where = dead_point ? LimbName(singularity.dead_limb) : "platform";
  summary.names_where = !dead_point;
  summary.amount = dead_point ? singularity.V_min : singularity.s_min;
  summary.unit = "1";
  summary.message = fmt::format(
      "the pose ({:.3f}, {:.3f}, {:.3f}) mm, {:.3f} deg is singular: {}", 1e3 * X[0], 1e3 * X[1],
      1e3 * X[2], X[3] * 180.0 / std::numbers::pi,
      dead_point ? fmt::format("limb {} is at its dead point (V = {:.2g})",
                               singularity.dead_limb + 1, singularity.V_min)
                 : fmt::format("with locked drives the platform is free (s_min = {:.2g})",
                               singularity.s_min));
  return summary;
}

}  // namespace mbv::scara_robot
