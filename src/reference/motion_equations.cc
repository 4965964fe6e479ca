#include "reference/motion_equations.h"

#include <algorithm>
#include <utility>

#include "math/spatial.h"

namespace mbv::internal {
namespace {

// Pivots smaller than this beside the largest may be round-off, and rows missed by more of the
// largest rate are not solved.
constexpr double kPivots = 1e-9, kMissed = 1e-10;

bool HasNoRotor(const Mechanism& mechanism) {
  return std::ranges::none_of(mechanism.elements, [](const ForceElement& element) {
    return std::holds_alternative<RotorLaw>(element.law);
  });
}

}  // namespace

MotionEquations::MotionEquations(const Mechanism& mechanism, double length)
    : mechanism_(mechanism),
      apply_(HasNoRotor(mechanism)),
      system_(mechanism.bodies.size(), length) {
  double largest = 0.0;
  for (const Body& body : mechanism.bodies) largest = std::max(largest, body.mass);
  if (largest > 0.0) mass_ = largest;
  std::vector<Eigen::Triplet<double>> entries;
  for (int b = 0; b < system_.size(); b += 6) {
    for (int c = 0; c < 6; ++c) {
      for (int r = 0; r < 6; ++r) entries.emplace_back(b + r, b + c, 0.0);
    }
  }
  M_.resize(system_.size(), system_.size());
  M_.setFromTriplets(entries.begin(), entries.end());
  M_.makeCompressed();
}

void MotionEquations::Choose(std::vector<int> rows) {
  rows_ = std::move(rows);
  chosen_ = true;
  made_ = false;
}

void MotionEquations::FillInertias(const BodyStates& states) {
  double* out = M_.valuePtr();
  for (size_t b = 1; b < mechanism_.bodies.size(); ++b, out += 36) {
    const Body& body = mechanism_.bodies[b];
    const Mat3 R = states.X_WB[b].linear();
    const Mat6 M = SpatialInertia(body.mass, R * body.p_BoBcm_B, R * body.I_Bcm_B * R.transpose());
    const auto scale = system_.body_scale().segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
    Eigen::Map<Mat6>{out} = scale.asDiagonal() * (M / mass_) * scale.asDiagonal();
  }
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
