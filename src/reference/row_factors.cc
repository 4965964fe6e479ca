#include "reference/row_factors.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mbv::internal {
namespace {

// Corrections of the pose use rows with larger pivots only; what a weaker row misses is second
// order there, and dividing round-off by its pivot would push the pose sideways.
constexpr double kFirm = 1e-5;
// Rows beyond the rank that hold less are not counted; closed loops leave 1e-11.
constexpr double kBeyond = 1e-6;
// Refinements of what follows from R alone, and inverse iterations.
constexpr int kRefinements = 3, kIterations = 8;

}  // namespace

RowFactors::RowFactors(size_t bodies, double length, int dofs, int largest_dense)
    : system_(bodies, length), dofs_(dofs), largest_dense_(largest_dense) {}

void RowFactors::Factor(const RowSet& rows) {
  std::vector<int> all(static_cast<size_t>(rows.size()));
  std::iota(all.begin(), all.end(), 0);
  columns_ = system_.ScaledColumns(rows, all);
  row_scale_.resize(rows.size());
  for (int i = 0; i < rows.size(); ++i) row_scale_[i] = system_.RowScale(rows.angular[i]);
  independent_ = system_.size() - dofs_;
  basis_.resize(0, 0);
  extra_ = 0.0;
  if (columns_.size() == 0) {  // every body floats
    sparse_.reset();
    pivot_ = independent_ == 0 ? 1.0 : 0.0;
    return;
  }
  const bool sparse = system_.size() > largest_dense_ && FactorSparse();
  if (sparse) return;
  sparse_.reset();
  FactorDense();
}

void RowFactors::FactorDense() {
  basis_.resize(0, 0);
  qr_.compute(MatX(columns_));
  const auto pivots = qr_.matrixQR().diagonal().cwiseAbs();
  const auto of = [&](Eigen::Index k) { return k < pivots.size() ? pivots[k] / pivots[0] : 0.0; };
  pivot_ = independent_ == 0 ? 1.0 : of(independent_ - 1);
  extra_ = of(independent_);
}

bool RowFactors::FactorSparse() {
  const SparseRank::Matrix J = columns_.transpose();
  sparse_.emplace(J, kBeyond);
  if (sparse_->rank() != independent_) return false;
  // (1): the rows' combinations leave the null space.
  basis_ = sparse_->NullSpace();
  for (Eigen::Index k = 0; k < basis_.cols(); ++k) {
    basis_.col(k) -= sparse_->SolveNormal(columns_ * (J * basis_.col(k)));
  }
  if (basis_.cols() > 0) {
    const Eigen::HouseholderQR<MatX> qr(basis_);
    basis_ = qr.householderQ() * MatX::Identity(basis_.rows(), basis_.cols());
  }
  double longest = 0.0;
  for (int k = 0; k < J.cols(); ++k) longest = std::max(longest, J.col(k).norm());
  // Long rows of loops have some weak motions, as σ ~ 1/loops².
  weak_.resize(system_.size(), 0);
  pivot_ = 1.0 / longest;
  for (Eigen::Index k = 0; independent_ > k; ++k) {
    VecX motion(system_.size());
    for (Eigen::Index i = 0; i < motion.size(); ++i) {
      motion[i] = 1.0 + 0.5 * std::sin(1.7 * static_cast<double>(i));  // a share in every direction
    }
    motion = WithoutBasis(motion);
    double singular_value = 1.0;
    for (int i = 0; i < kIterations; ++i) {
      motion -= weak_ * (weak_.transpose() * motion);
      motion.normalize();
      motion = WithoutBasis(sparse_->SolveNormal(motion));
      singular_value = 1.0 / std::sqrt(motion.norm());
    }
    motion -= weak_ * (weak_.transpose() * motion);
    motion.normalize();
    const double pivot = singular_value / longest;
    if (!std::isfinite(pivot)) return false;
    if (k == 0) soft_ = motion, pivot_ = pivot;
    if (pivot > kFirm) return true;
    weak_.conservativeResize(Eigen::NoChange, k + 1);
    weak_.col(k) = motion;
  }
  return true;
}

VecX RowFactors::WithoutBasis(const VecX& V) const { return V - basis_ * (basis_.transpose() * V); }

const MatX& RowFactors::Basis() const {
  if (basis_.size() > 0 || dofs_ == 0) {
    if (dofs_ == 0) basis_.resize(system_.size(), 0);
    return basis_;
  }
  basis_ = MatX::Zero(system_.size(), dofs_);
  basis_.bottomRows(dofs_).setIdentity();
  if (columns_.size() > 0) basis_.applyOnTheLeft(qr_.householderQ());
  return basis_;
}

VecX RowFactors::WeakestMotion() const {
  if (sparse_) return system_.body_scale().cwiseProduct(soft_);
  // The part of the weakest row that no stronger one holds.
  VecX motion = VecX::Unit(system_.size(), independent_ - 1);
  if (columns_.size() > 0) motion.applyOnTheLeft(qr_.householderQ());
  return system_.body_scale().cwiseProduct(motion);
}

VecX RowFactors::LeastMotion(const VecX& rates, bool firm) const {
  VecX motion = VecX::Zero(system_.size());
  const VecX scaled = rates.cwiseProduct(row_scale_);
  if (sparse_) {
    for (int i = 0; i < kRefinements; ++i) {
      motion += sparse_->SolveNormal(columns_ * (scaled - columns_.transpose() * motion));
    }
    if (firm) motion -= weak_ * (weak_.transpose() * motion);
    return system_.body_scale().cwiseProduct(WithoutBasis(motion));
  }
  if (columns_.size() == 0) return motion;
  const auto pivots = qr_.matrixQR().diagonal().cwiseAbs();
  Eigen::Index rank = std::min<Eigen::Index>(independent_, pivots.size());
  while (firm && rank > 0 && pivots[rank - 1] < kFirm * pivots[0]) --rank;
  // Jᵀ P = Q R, so the chosen rows give R₁ᵀ (Q₁ᵀ V) = (P ᵀrates)₁.
  const VecX ordered = qr_.colsPermutation().transpose() * scaled;
  const auto R = qr_.matrixQR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
  motion.head(rank) = R.transpose().solve(ordered.head(rank));
  motion.applyOnTheLeft(qr_.householderQ());
  return system_.body_scale().cwiseProduct(motion);
}

double RowFactors::ShareLeft(const VecX& gradient) const {
  const VecX scaled = system_.body_scale().cwiseProduct(gradient);
  return (Basis().transpose() * scaled).norm() / scaled.norm();
}

std::vector<int> RowFactors::IndependentRows(const RowSet& rows) const {
  std::vector<int> chosen;
  if (sparse_) {
    chosen.resize(static_cast<size_t>(rows.size()));
    std::iota(chosen.begin(), chosen.end(), 0);
    chosen = system_.IndependentRows(rows, chosen);
  } else if (columns_.size() > 0 && independent_ <= columns_.cols()) {
    const auto& order = qr_.colsPermutation().indices();
    chosen.assign(order.data(), order.data() + independent_);
    std::ranges::sort(chosen);
  }
  if (static_cast<Eigen::Index>(chosen.size()) != independent_) chosen.clear();
  return chosen;
}

}  // namespace mbv::internal
