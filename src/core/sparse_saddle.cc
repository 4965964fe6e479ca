#include "core/sparse_saddle.h"

#include <algorithm>

namespace mbv {
namespace {

// Weight of the norm: about the smallest singular value of A, for which the condition of the whole
// is A's [Björck 1996, §2.5.2].
constexpr double kNormWeight = 0.05;

// Index of an entry of a compressed matrix that is there.
int PlaceOf(const SparseLu::Matrix& matrix, Eigen::Index row, Eigen::Index column) {
  const int* first = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column];
  const int* last = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column + 1];
  return static_cast<int>(std::lower_bound(first, last, row) - matrix.innerIndexPtr());
}

template <typename Visit>
void ForEntries(const SparseLu::Matrix& matrix, const Visit& visit) {
  for (Eigen::Index c = 0; c < matrix.cols(); ++c) {
    for (SparseLu::Matrix::InnerIterator entry(matrix, c); entry; ++entry) visit(entry.row(), c);
  }
}

}  // namespace

void SparseSaddle::Reset() {
  K_.resize(0, 0);
  lu_.Reset();
}

void SparseSaddle::MakePattern(const Matrix& W, const Matrix& B_transposed) {
  const Eigen::Index n = W.cols(), size = n + B_transposed.cols();
  std::vector<Eigen::Triplet<double>> entries;
  ForEntries(W, [&](auto r, auto c) { entries.emplace_back(r, c, 0.0); });
  ForEntries(B_transposed, [&](auto r, auto c) {
    entries.emplace_back(r, n + c, 0.0);
    entries.emplace_back(n + c, r, 0.0);
  });
  K_.resize(size, size);
  K_.setFromTriplets(entries.begin(), entries.end());
  K_.makeCompressed();
  of_W_.clear();
  in_rows_.clear();
  in_columns_.clear();
  ForEntries(W, [&](auto r, auto c) { of_W_.push_back(PlaceOf(K_, r, c)); });
  ForEntries(B_transposed, [&](auto r, auto c) {
    in_columns_.push_back(PlaceOf(K_, n + c, r));
    in_rows_.push_back(PlaceOf(K_, r, n + c));
  });
}

bool SparseSaddle::Factor(const Matrix& W, const Matrix& B_transposed, double tolerance) {
  if (K_.cols() == 0) MakePattern(W, B_transposed);
  double* values = K_.valuePtr();
  for (size_t k = 0; k < of_W_.size(); ++k) values[of_W_[k]] = W.valuePtr()[k];
  for (size_t k = 0; k < in_rows_.size(); ++k) {
    values[in_columns_[k]] = B_transposed.valuePtr()[k];
    values[in_rows_[k]] = -B_transposed.valuePtr()[k];
  }
  return lu_.Factor(K_) && lu_.PivotRatio() > tolerance;
}

void SparseSaddle::Solve(const VecX& c, const VecX& b, VecX* x, VecX* y, int refinements) const {
  right_.resize(K_.cols());
  right_ << c, b;
  both_ = right_;
  lu_.Solve(&both_);
  for (int i = 0; i < refinements; ++i) {
    rest_ = right_;
    rest_.noalias() -= K_ * both_;
    lu_.Solve(&rest_);
    both_ += rest_;
  }
  *x = both_.head(c.size());
  *y = both_.tail(b.size());
}

void SparseLeastNorm::MakePattern(const SparseLu::Matrix& A) {
  weight_.resize(A.cols(), A.cols());
  weight_.setIdentity();
  weight_ *= kNormWeight;
  zero_cols_.setZero(A.cols());
  zero_rows_.setZero(A.rows());
  SparseLu::Matrix places = A;
  for (int k = 0; k < A.nonZeros(); ++k) places.valuePtr()[k] = k;
  A_ = places.transpose();
  from_.assign(A_.valuePtr(), A_.valuePtr() + A_.nonZeros());
}

bool SparseLeastNorm::Factor(const SparseLu::Matrix& A, double tolerance) {
  if (weight_.cols() != A.cols() || A_.nonZeros() != A.nonZeros()) MakePattern(A);
  double* values = A_.valuePtr();
  for (const int from : from_) *values++ = A.valuePtr()[from];
  return saddle_.Factor(weight_, A_, tolerance);
}

VecX SparseLeastNorm::LeastNorm(const VecX& b) const {
  VecX x;
  saddle_.Solve(zero_cols_, b, &x, &y_);
  return x;
}

VecX SparseLeastNorm::LeastSquares(const VecX& c, int refinements) const {
  VecX y;
  saddle_.Solve(c, zero_rows_, &x_, &y, refinements);
  return -y;
}

}  // namespace mbv
