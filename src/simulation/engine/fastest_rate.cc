#include "simulation/engine/fastest_rate.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "simulation/engine/element_forces.h"

namespace mbv::simulation {
namespace {

// Along u: stiffness k, damping c.
struct Elastic {
  std::string name;
  VecX u;
  double k = 0.0, c = 0.0;
};

std::vector<Elastic> ElasticParts(const ConstraintSystem& system, const ServoGains& servo) {
  const EngineModel& engine = system.engine();
  std::vector<Elastic> parts;
  for (size_t s = 0; s < engine.spring_tendon.size(); ++s) {
    const SpringDamper& spring = engine.mechanism->springs[s];
    const double* J = system.data()->ten_J + engine.spring_tendon[s] * system.nv();
    parts.push_back({"spring '" + spring.name + "'", Eigen::Map<const VecX>(J, system.nv()),
                     spring.stiffness, spring.damping});
  }
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    const ForceElement& element = engine.mechanism->elements[e];
    const ElementSlope slope = SlopeOf(element, ElementMotionOf(system, e).position);
    if (slope.stiffness == 0.0 && slope.damping == 0.0) continue;
    parts.push_back({"element '" + element.name + "'", ElementGradient(system, e), slope.stiffness,
                     slope.damping});
  }
  for (Eigen::Index k = 0; k < servo.kp.size(); ++k) {
    const auto drive = static_cast<int>(k);
    parts.push_back({"the servo of '" + engine.driven[static_cast<size_t>(k)].name + "'",
                     system.DrivenJacobian(drive), servo.kp[k], servo.kv[k]});
  }
  return parts;
}

// Columns: a basis of the motions that the constraints leave.
MatX FreeMotions(const ConstraintSystem& system) {
  const int nv = system.nv();
  if (system.rows() == 0) return MatX::Identity(nv, nv);
  constexpr double kRankTolerance = 1e-9;
  Eigen::ColPivHouseholderQR<MatX> qr;
  qr.setThreshold(kRankTolerance);
  qr.compute(MatX(system.J()).transpose());
  const MatX Q = OrthogonalFactor(qr);
  return Q.rightCols(nv - qr.rank());
}

// The part with most of the energy of a mode of velocities x.
std::string PartOf(const std::vector<Elastic>& parts, const Eigen::VectorXcd& x, double rate) {
  std::string name;
  double most = -1.0;
  for (const Elastic& part : parts) {
    const std::complex<double> along = (part.u.cast<std::complex<double>>().transpose() * x)(0);
    const double share = (std::abs(part.k) + part.c * rate) * std::norm(along);
    if (share <= most) continue;
    most = share;
    name = part.name;
  }
  return name;
}

}  // namespace

FastestRate FastestRateOf(const ConstraintSystem& system, const ServoGains& servo,
                          double duration_s) {
  FastestRate fastest;
  const std::vector<Elastic> parts = ElasticParts(system, servo);
  if (parts.empty()) return fastest;
  const MatX N = FreeMotions(system);
  const Eigen::Index n = N.cols();
  if (n == 0) return fastest;
  const mjModel* m = system.engine().m.get();
  mj_crb(m, system.data());
  RowMajor M(m->nv, m->nv);
  mj_fullM(m, M.data(), system.data()->qM);
  // (1)
  MatX K = MatX::Zero(n, n), C = MatX::Zero(n, n);
  for (const Elastic& part : parts) {
    const VecX u = N.transpose() * part.u;
    K += part.k * u * u.transpose();
    C += part.c * u * u.transpose();
  }
  const Eigen::LDLT<MatX> M_N(MatX(N.transpose() * M * N));
  MatX A = MatX::Zero(2 * n, 2 * n);
  A.topRightCorner(n, n).setIdentity();
  A.bottomLeftCorner(n, n) = -M_N.solve(K);
  A.bottomRightCorner(n, n) = -M_N.solve(C);
  // (2), (3)
  const Eigen::EigenSolver<MatX> modes(A);
  Eigen::Index fast = 0, worst = 0;
  fastest.per_s = modes.eigenvalues().cwiseAbs().maxCoeff(&fast);
  for (Eigen::Index k = 0; k < modes.eigenvalues().size(); ++k) {
    const double rate = std::abs(modes.eigenvalues()[k]);
    const double damping = std::abs(modes.eigenvalues()[k].real());
    const double lasts = damping * duration_s > 1.0 ? 1.0 / damping : duration_s;
    const double drift = 1e-3 * std::pow(rate, 5) * lasts;
    if (drift <= fastest.drift) continue;
    fastest.drift = drift;
    fastest.drift_per_s = rate;
    worst = k;
  }
  const auto part_of = [&](Eigen::Index k) {
    const Eigen::VectorXcd x = N * modes.eigenvectors().col(k).head(n);
    return PartOf(parts, x, std::abs(modes.eigenvalues()[k]));
  };
  fastest.part = part_of(fast);
  fastest.drift_part = part_of(worst);
  return fastest;
}

}  // namespace mbv::simulation
