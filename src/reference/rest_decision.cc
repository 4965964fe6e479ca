#include "reference/rest_decision.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace mbv::internal {
namespace {

// Rows of G that depend on others to this share are taken to.
constexpr double kDependent = 1e-9;
// Choices of elements that are looked through for (4).
constexpr long kMostChoices = 20000;
// Sweeps of the projected Gauss–Seidel iteration for (3).
constexpr int kMostSweeps = 20000;
// Elements that take a smaller share in a motion stay out of it.
constexpr double kLeftOut = 1e-6;
// A smaller share of what an element's acceleration is made of is none.
constexpr double kStarts = 1e-9;

// Rows of unit length: coordinates may have different units.
MatX UnitRows(const MatX& G) {
  MatX unit = G;
  for (Eigen::Index e = 0; e < G.rows(); ++e) unit.row(e).normalize();
  return unit;
}

// The DOFs that held elements take (first `rank` columns) and those they leave.
struct Split {
  MatX Q;
  Eigen::Index rank = 0;
};

Split SplitDofs(const MatX& G) {
  Split split;
  split.Q = MatX::Identity(G.cols(), G.cols());
  if (G.rows() == 0 || G.cols() == 0) return split;
  Eigen::ColPivHouseholderQR<MatX> qr;
  qr.setThreshold(kDependent);
  qr.compute(UnitRows(G).transpose());
  split.Q = OrthogonalFactor(qr);
  split.rank = qr.rank();
  return split;
}

// y with rows · y = 0, if it is unique up to its length.
bool OnlyMotion(const MatX& rows, VecX* y) {
  if (rows.rows() == 0) {
    *y = VecX::Ones(1);
    return rows.cols() == 1;
  }
  Eigen::FullPivLU<MatX> lu(rows);
  lu.setThreshold(kDependent);
  if (lu.dimensionOfKernel() != 1) return false;
  *y = lu.kernel().col(0);
  return true;
}

long Choices(long n, long k) {
  double count = 1.0;
  for (long i = 1; i <= k; ++i) count *= static_cast<double>(n - k + i) / static_cast<double>(i);
  return count > 1e9 ? 1000000000L : std::lround(count);
}

// `system` without the elements that start, whose friction is among the forces.
RestSystem WithoutStarting(const RestSystem& system, const std::vector<int>& sign) {
  const auto held = std::ranges::count(sign, 0);
  RestSystem rest{.H = system.H,
                  .f = system.f,
                  .G = MatX(held, system.G.cols()),
                  .d = VecX(held),
                  .most = VecX(held)};
  Eigen::Index next = 0;
  for (size_t k = 0; k < sign.size(); ++k) {
    const auto e = static_cast<Eigen::Index>(k);
    if (sign[k] != 0) {
      rest.f -= sign[k] * system.most[e] * system.G.row(e).transpose();
      continue;
    }
    rest.G.row(next) = system.G.row(e);
    rest.d[next] = system.d[e];
    rest.most[next++] = system.most[e];
  }
  return rest;
}

// (3) by projected Gauss–Seidel.
VecX LeastOf(const MatX& A, const VecX& c, const VecX& most) {
  VecX lambda = VecX::Zero(c.size());
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    double change = 0.0;
    for (Eigen::Index e = 0; e < c.size(); ++e) {
      const double next = lambda[e] - (A.row(e).dot(lambda) + c[e]) / A(e, e);
      const double in = std::clamp(next, -most[e], most[e]);
      change = std::max(change, std::abs(in - lambda[e]) / most[e]);
      lambda[e] = in;
    }
    if (change <= kEps) break;
  }
  return lambda;
}

// (1) of a choice of signs.
bool Consistent(const RestSystem& system, const std::vector<int>& sign) {
  const RestSystem held = WithoutStarting(system, sign);
  if (!(LoadRatio(held) <= 1.0 + kStarts)) return false;
  const VecX q = system.G * HeldMotion(held) + system.d;
  for (size_t e = 0; e < sign.size(); ++e) {
    if (sign[e] * q[static_cast<Eigen::Index>(e)] < 0.0) return false;
  }
  return true;
}

}  // namespace

VecX HeldMotion(const RestSystem& system) {
  const Split split = SplitDofs(system.G);
  const Eigen::Index left = system.G.cols() - split.rank;
  VecX u = VecX::Zero(system.G.cols());
  if (split.rank > 0) {
    const MatX P = split.Q.leftCols(split.rank);
    u = P * (system.G * P).colPivHouseholderQr().solve(VecX(-system.d));
  }
  if (left == 0) return u;
  const MatX N = split.Q.rightCols(left);
  const MatX inertia = N.transpose() * system.H * N;
  return u + N * inertia.ldlt().solve(VecX(N.transpose() * (system.f - system.H * u)));
}

VecX LeastShares(const RestSystem& system) {
  const Eigen::Index count = system.G.rows();
  VecX share = VecX::Zero(count);
  if (SplitDofs(system.G).rank == count) {
    const VecX load = system.H * HeldMotion(system) - system.f;
    return system.G.transpose().colPivHouseholderQr().solve(load);
  }
  RestSystem left = system;
  std::vector<Eigen::Index> which(static_cast<size_t>(count));
  std::iota(which.begin(), which.end(), 0);
  while (!which.empty()) {
    VecX direction = VecX::Zero(left.G.rows());
    const double ratio = LoadRatio(left, &direction);
    if (std::isnan(ratio)) return VecX::Constant(count, kNan);
    direction = direction.cwiseQuotient(left.G.rowwise().norm());
    const double least = kLeftOut * direction.cwiseAbs().maxCoeff();
    // Those of the motion nearest to starting are known; the others share what is left.
    std::vector<Eigen::Index> rest;
    for (Eigen::Index e = 0; e < direction.size(); ++e) {
      if (!(std::abs(direction[e]) > least)) {
        rest.push_back(e);
        continue;
      }
      const double force = -std::copysign(ratio * left.most[e], direction[e]);
      share[which[static_cast<size_t>(e)]] = force;
      left.f += force * left.G.row(e).transpose();
    }
    if (rest.size() == which.size()) return share;
    left.G = MatX(left.G(rest, Eigen::all));
    left.d = VecX(left.d(rest));
    left.most = VecX(left.most(rest));
    for (Eigen::Index& e : rest) e = which[static_cast<size_t>(e)];
    which = std::move(rest);
  }
  return share;
}

double LoadRatio(const RestSystem& system, VecX* direction) {
  if (system.G.rows() == 0) return 0.0;
  const VecX load = system.H * HeldMotion(system) - system.f;
  const Split split = SplitDofs(system.G);
  const MatX P = split.Q.leftCols(split.rank);
  const MatX along = system.G * P, unit = UnitRows(system.G) * P;
  const VecX r = P.transpose() * load;
  const Eigen::Index vanish = split.rank - 1;
  if (Choices(system.G.rows(), vanish) > kMostChoices) return kNan;
  std::vector<char> chosen(static_cast<size_t>(system.G.rows()), 0);
  std::fill_n(chosen.begin(), vanish, 1);
  double largest = 0.0;
  do {
    MatX rows(vanish, split.rank);
    Eigen::Index next = 0;
    for (Eigen::Index e = 0; e < unit.rows(); ++e) {
      if (chosen[static_cast<size_t>(e)] != 0) rows.row(next++) = unit.row(e);
    }
    VecX y;
    if (!OnlyMotion(rows, &y)) continue;
    const VecX rates = along * y;
    const double ratio = std::abs(r.dot(y)) / system.most.dot(rates.cwiseAbs());
    if (!(ratio > largest)) continue;
    largest = ratio;
    // Friction would have to exert r; the motion starts against it.
    if (direction != nullptr) *direction = r.dot(y) > 0.0 ? VecX(-rates) : rates;
  } while (std::prev_permutation(chosen.begin(), chosen.end()));
  return largest;
}

bool DecideRest(const RestSystem& system, std::vector<int>* sign) {
  const auto factors = system.H.ldlt();
  const MatX A = system.G * factors.solve(MatX(system.G.transpose()));
  const VecX c = system.G * factors.solve(system.f) + system.d;
  const VecX lambda = LeastOf(A, c, system.most);
  const VecX q = A * lambda + c;
  const VecX scale = c.cwiseAbs() + A.cwiseAbs() * system.most;
  sign->assign(static_cast<size_t>(c.size()), 0);
  for (Eigen::Index e = 0; e < c.size(); ++e) {
    if (std::abs(q[e]) <= kStarts * scale[e]) continue;
    (*sign)[static_cast<size_t>(e)] = q[e] > 0.0 ? 1 : -1;
  }
  return Consistent(system, *sign);
}

}  // namespace mbv::internal
