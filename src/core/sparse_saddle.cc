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

void SparseSaddle::Solve(const VecX& c, const VecX& b, VecX* x, VecX* y) const {
  VecX both = VecX::Zero(K_.cols()), right(K_.cols());
  right << c, b;
  VecX rest = right;
  for (int pass = 0; pass < 2; ++pass) {
    lu_.Solve(&rest);
    both += rest;
    if (pass == 0) rest = right - K_ * both;
  }
  *x = both.head(c.size());
  *y = both.tail(b.size());
}

bool SparseLeastNorm::Factor(const SparseLu::Matrix& A, double tolerance) {
  A_ = A.transpose();
  if (weight_.cols() != A.cols()) {
    weight_.resize(A.cols(), A.cols());
    weight_.setIdentity();
    weight_ *= kNormWeight;
  }
  return saddle_.Factor(weight_, A_, tolerance);
}

VecX SparseLeastNorm::LeastNorm(const VecX& b) const {
  VecX x, y;
  saddle_.Solve(VecX::Zero(A_.rows()), b, &x, &y);
  return x;
}

VecX SparseLeastNorm::LeastSquares(const VecX& c) const {
  VecX x, y;
  saddle_.Solve(c, VecX::Zero(A_.cols()), &x, &y);
  return -y;
}

}  // namespace mbv
