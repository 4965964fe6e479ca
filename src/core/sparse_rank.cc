#include "core/sparse_rank.h"

#include <Eigen/SparseQR>
#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// Of pivots and rests beside the tolerance, and of singular values.
constexpr double kClear = 1e3, kClearSingular = 10.0;
// Inverse iterations that estimate a singular value.
constexpr int kIterations = 6;
// Columns to which Q is applied at once.
constexpr Eigen::Index kAtOnce = 64;

double LongestColumn(const SparseRank::Matrix& A) {
  double longest = 0.0;
  for (int c = 0; c < A.cols(); ++c) longest = std::max(longest, A.col(c).norm());
  return longest;
}

}  // namespace

struct SparseRank::Factors {
  Eigen::SparseQR<Matrix, Eigen::COLAMDOrdering<int>> qr;
  Eigen::Index rows = 0;
  Matrix R;  ///< of the columns kept
};

SparseRank::~SparseRank() = default;
SparseRank::SparseRank(SparseRank&&) noexcept = default;

SparseRank::SparseRank(const Matrix& A, double tolerance) : factors_(std::make_unique<Factors>()) {
  const double limit = tolerance * LongestColumn(A);
  factors_->rows = A.rows();
  if (!(limit > 0.0)) {
    clear_ = limit == 0.0;  // nothing but zeros
    return;
  }
  factors_->qr.setPivotThreshold(limit);
  factors_->qr.compute(A);
  factors_->R = factors_->qr.matrixR().topLeftCorner(rank(), rank());
  smallest_kept_ = SmallestSingularValue();
  largest_dropped_ = LongestRest(A);
  const double least_pivot = factors_->R.diagonal().cwiseAbs().minCoeff();
  clear_ = factors_->qr.info() == Eigen::Success && least_pivot > kClear * limit &&
           smallest_kept_ > kClearSingular * limit && largest_dropped_ <= limit / kClear;
}

int SparseRank::rank() const {
  return factors_->R.cols() > 0 || factors_->qr.cols() > 0 ? static_cast<int>(factors_->qr.rank())
                                                           : 0;
}

std::vector<int> SparseRank::Independent() const {
  std::vector<int> kept;
  if (rank() == 0) return kept;
  const auto& order = factors_->qr.colsPermutation().indices();
  for (int k = 0; k < rank(); ++k) kept.push_back(order[k]);
  std::sort(kept.begin(), kept.end());
  return kept;
}

double SparseRank::SmallestSingularValue() const {
  const Matrix& R = factors_->R;
  VecX x(R.cols());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = 1.0 + 0.5 * std::sin(1.7 * static_cast<double>(i));  // a share in every direction
  }
  double sigma = 0.0;
  for (int i = 0; i < kIterations; ++i) {
    x.normalize();
    R.triangularView<Eigen::Upper>().solveInPlace(x);
    R.transpose().triangularView<Eigen::Lower>().solveInPlace(x);
    sigma = 1.0 / std::sqrt(x.norm());
  }
  return std::isfinite(sigma) ? sigma : 0.0;
}

double SparseRank::LongestRest(const Matrix& A) const {
  const auto& order = factors_->qr.colsPermutation().indices();
  const Eigen::Index below = factors_->rows - rank();
  double longest = 0.0;
  for (Eigen::Index first = rank(); first < A.cols() && below > 0; first += kAtOnce) {
    const Eigen::Index count = std::min(kAtOnce, A.cols() - first);
    MatX columns(A.rows(), count);
    for (Eigen::Index k = 0; k < count; ++k) columns.col(k) = A.col(order[first + k]);
    const MatX in_Q = factors_->qr.matrixQ().adjoint() * columns;
    longest = std::max(longest, in_Q.bottomRows(below).colwise().norm().maxCoeff());
  }
  return longest;
}

MatX SparseRank::Complement() const {
  const Eigen::Index rows = factors_->rows, left = rows - rank();
  if (rank() == 0) return MatX::Identity(rows, rows);
  MatX complement(rows, left);
  for (Eigen::Index first = 0; first < left; first += kAtOnce) {
    const Eigen::Index count = std::min(kAtOnce, left - first);
    MatX unit = MatX::Zero(rows, count);
    for (Eigen::Index k = 0; k < count; ++k) unit(rank() + first + k, k) = 1.0;
    const MatX columns = factors_->qr.matrixQ() * unit;
    complement.middleCols(first, count) = columns;
  }
  return complement;
}

}  // namespace mbv
