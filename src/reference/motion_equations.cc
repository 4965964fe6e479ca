#include "reference/motion_equations.h"

#include <algorithm>
#include <utility>

#include "math/spatial.h"

namespace mbv::internal {
namespace {

// Pivots smaller than this beside the largest may be round-off, and rows missed by more of the
// largest rate are not solved.
constexpr double kPivots = 1e-9, kMissed = 1e-10;

}  // namespace

MotionEquations::MotionEquations(const Mechanism& mechanism, double length)
    : mechanism_(mechanism), system_(mechanism.bodies.size(), length) {
  double largest = 0.0;
  for (const Body& body : mechanism.bodies) largest = std::max(largest, body.mass);
  if (largest > 0.0) mass_ = largest;
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<std::pair<int, int>> corners;
  BodyStates home;
  home.Resize(mechanism.bodies.size());
  home.X_WB = mechanism.X_WB_home;
  ForInertias(home, [&](size_t b, size_t c, const Mat6& /*block*/) {
    const auto& [row, column] =
        corners.emplace_back(6 * (static_cast<int>(b) - 1), 6 * (static_cast<int>(c) - 1));
    for (int k = 0; k < 36; ++k) entries.emplace_back(row + k % 6, column + k / 6, 0.0);
  });
  M_.resize(system_.size(), system_.size());
  M_.setFromTriplets(entries.begin(), entries.end());
  M_.makeCompressed();
  const int* rows = M_.innerIndexPtr();
  for (const auto& [row, column] : corners) {
    const int first = M_.outerIndexPtr()[column], last = M_.outerIndexPtr()[column + 1];
    places_.push_back(static_cast<int>(std::lower_bound(rows + first, rows + last, row) - rows));
  }
}

void MotionEquations::Choose(std::vector<int> rows) {
  rows_ = std::move(rows);
  chosen_ = true;
  made_ = false;
}

void MotionEquations::ForInertias(const BodyStates& states, const AddInertia& add) const {
  for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
    const Body& body = mechanism_.bodies[b];
    const Mat3 R = states.X_WB[b].linear();
    add(b, b,
        states.Carried(b) *
            SpatialInertia(body.mass, R * body.p_BoBcm_B, R * body.I_Bcm_B * R.transpose()));
  }
  ForRotorInertias(mechanism_, states, add);
}

void MotionEquations::FillInertias(const BodyStates& states) {
  Eigen::Map<VecX>(M_.valuePtr(), M_.nonZeros()).setZero();
  const auto scale = [&](size_t body) {
    return system_.body_scale().segment<6>(6 * (static_cast<Eigen::Index>(body) - 1));
  };
  auto place = places_.begin();
  ForInertias(states, [&](size_t b, size_t c, const Mat6& block) {
    const int* column = M_.outerIndexPtr() + 6 * (c - 1);
    Eigen::Map<Mat6, 0, Eigen::OuterStride<>>{M_.valuePtr() + *place++,
                                              Eigen::OuterStride<>(column[1] - column[0])} +=
        scale(b).asDiagonal() * (block / mass_) * scale(c).asDiagonal();
  });
}

bool MotionEquations::Solve(const BodyStates& states, const RowSet& rows, const VecX& wrenches,
                            const VecX& rates, VecX* A) {
  FillInertias(states);
  if (made_) {
    system_.FillColumns(rows, rows_, &columns_);
  } else {
    system_.MakeColumns(rows, rows_, &columns_);
    saddle_.Reset();
    made_ = true;
  }
  VecX asked(static_cast<Eigen::Index>(rows_.size())), lambda;
  for (size_t k = 0; k < rows_.size(); ++k) {
    asked[static_cast<Eigen::Index>(k)] =
        system_.RowScale(rows.angular[static_cast<size_t>(rows_[k])]) * rates[rows_[k]];
  }
  chosen_ = saddle_.Factor(M_, columns_, kPivots);
  if (!chosen_) return false;
  saddle_.Solve(system_.body_scale().cwiseProduct(wrenches) / mass_, asked, A, &lambda);
  const double missed = (columns_.transpose() * *A - asked).lpNorm<Eigen::Infinity>();
  const double largest = std::max(asked.lpNorm<Eigen::Infinity>(), A->lpNorm<Eigen::Infinity>());
  chosen_ = missed <= kMissed * largest;
  *A = system_.body_scale().cwiseProduct(*A);
  return chosen_;
}

}  // namespace mbv::internal
