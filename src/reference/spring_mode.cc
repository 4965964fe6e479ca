#include "reference/spring_mode.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>

#include "core/spatial.h"
#include "reference/force_solver.h"

namespace mbv::internal {
namespace {

// Steps grow by this root of the amplitude: the scheme of order 7 is the one whose error is
// controlled.
constexpr double kOrder = 7.0;
// Angle λh [rad] beyond which a step of Runge–Kutta–Fehlberg 7(8) is unstable for sure, so that the
// estimate is no larger than what is needed; and one so small that no tolerance above round-off
// asks for it.
constexpr double kStable = 10.0, kTooFine = 0.02;

// Mᵇ R per body.
MatX Momenta(const Mechanism& mechanism, const BodyStates& states, const MatX& R) {
  MatX MR(R.rows(), R.cols());
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Mat3 R_WB = states.X_WB[b].linear();
    const Mat6 M =
        SpatialInertia(body.mass, R_WB * body.p_BoBcm_B, R_WB * body.I_Bcm_B * R_WB.transpose());
    const auto at = 6 * (static_cast<Eigen::Index>(b) - 1);
    MR.middleRows<6>(at) = M * R.middleRows<6>(at);
  }
  return MR;
}

// The gradient of a spring's length along the motions.
VecX Along(const SpringDamper& spring, const Mechanism& mechanism, const BodyStates& states,
           const MatX& R) {
  const ScalarRow row = LengthRow(spring, mechanism, states);
  VecX u = VecX::Zero(R.cols());
  if (row.parent > 0) u += R.middleRows<6>(6 * (row.parent - 1)).transpose() * row.J_parent;
  if (row.child > 0) u += R.middleRows<6>(6 * (row.child - 1)).transpose() * row.J_child;
  return u;
}

}  // namespace

SpringMode FastestSpringMode(const Mechanism& mechanism, const BodyStates& states,
                             const MatX& motions) {
  SpringMode mode;
  const Eigen::Index n = motions.cols();
  if (mechanism.springs.empty() || n == 0) return mode;
  MatX K = MatX::Zero(n, n), C = MatX::Zero(n, n);
  std::vector<VecX> along;
  for (const SpringDamper& spring : mechanism.springs) {
    const VecX& u = along.emplace_back(Along(spring, mechanism, states, motions));
    K += spring.stiffness * u * u.transpose();
    C += spring.damping * u * u.transpose();
  }
  const Eigen::LDLT<MatX> inertia(motions.transpose() * Momenta(mechanism, states, motions));
  MatX A = MatX::Zero(2 * n, 2 * n);
  A.topRightCorner(n, n).setIdentity();
  A.bottomLeftCorner(n, n) = -inertia.solve(K);
  A.bottomRightCorner(n, n) = -inertia.solve(C);
  if (!A.allFinite()) return mode;
  const Eigen::EigenSolver<MatX> modes(A);
  Eigen::Index fastest = 0;
  mode.rate_per_s = modes.eigenvalues().cwiseAbs().maxCoeff(&fastest);
  mode.decay_per_s = std::max(0.0, -modes.eigenvalues()[fastest].real());
  const Eigen::VectorXcd x = modes.eigenvectors().col(fastest).head(n);
  double most = -1.0;
  for (size_t s = 0; s < along.size(); ++s) {
    const SpringDamper& spring = mechanism.springs[s];
    const double share = (spring.stiffness + spring.damping * mode.rate_per_s) *
                         std::norm(along[s].cast<std::complex<double>>().dot(x));
    if (share <= most) continue;
    most = share;
    mode.spring = spring.name;
  }
  return mode;
}

double StepsToFollow(const SpringMode& mode, double step_s, double ahead_s) {
  const double angle = mode.rate_per_s * step_s;
  if (!(angle > kTooFine && angle < kStable)) return 0.0;
  if (!(mode.decay_per_s > 0.0)) return ahead_s / step_s;
  // Until the steps have grown to what is stable, and from there on.
  const double grows = mode.decay_per_s / kOrder;
  const double growing_s = std::min(ahead_s, std::log(kStable / angle) / grows);
  return -std::expm1(-grows * growing_s) / (grows * step_s) +
         mode.rate_per_s * (ahead_s - growing_s) / kStable;
}

}  // namespace mbv::internal
