#include "reference/spring_mode.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>

#include "reference/element_forces.h"
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

// What yields along a coordinate of gradient u.
struct Yielding {
  std::string name;
  VecX u;
  double stiffness = 0.0, damping = 0.0;
};

// A coordinate's gradient along the motions.
VecX Along(const ScalarRow& row, const MatX& R) {
  VecX u = VecX::Zero(R.cols());
  if (row.parent > 0) u += R.middleRows<6>(6 * (row.parent - 1)).transpose() * row.J_parent;
  if (row.child > 0) u += R.middleRows<6>(6 * (row.child - 1)).transpose() * row.J_child;
  return u;
}

// Springs, then force elements.
std::vector<Yielding> YieldingParts(const Mechanism& mechanism, const BodyStates& states,
                                    const MatX& motions) {
  std::vector<Yielding> parts;
  for (const SpringDamper& spring : mechanism.springs) {
    const ScalarRow row = LengthRow(spring, mechanism, states);
    parts.push_back({spring.name, Along(row, motions), spring.stiffness, spring.damping});
  }
  const std::vector<ScalarRow> rows = ElementRows(mechanism, states);
  for (size_t e = 0; e < rows.size(); ++e) {
    const ForceElement& element = mechanism.elements[e];
    const ElementSlope slope = SlopeOf(element, rows[e].value);
    if (slope.stiffness == 0.0 && slope.damping == 0.0) continue;
    parts.push_back({element.name, Along(rows[e], motions), slope.stiffness, slope.damping});
  }
  return parts;
}

}  // namespace

SpringMode FastestSpringMode(const Mechanism& mechanism, const BodyStates& states,
                             const MatX& motions) {
  SpringMode mode;
  const Eigen::Index n = motions.cols();
  const std::vector<Yielding> parts = YieldingParts(mechanism, states, motions);
  if (parts.empty() || n == 0) return mode;
  MatX K = MatX::Zero(n, n), C = MatX::Zero(n, n);
  for (const Yielding& part : parts) {
    K += part.stiffness * part.u * part.u.transpose();
    C += part.damping * part.u * part.u.transpose();
  }
  const Eigen::LDLT<MatX> inertia(MatX(motions.transpose() * Momenta(mechanism, states, motions)));
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
  for (const Yielding& part : parts) {
    const double share = (std::abs(part.stiffness) + part.damping * mode.rate_per_s) *
                         std::norm(part.u.cast<std::complex<double>>().dot(x));
    if (share <= most) continue;
    most = share;
    mode.spring = part.name;
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
