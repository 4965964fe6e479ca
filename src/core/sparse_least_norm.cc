#include "core/sparse_least_norm.h"

#include <algorithm>

namespace mbv {
namespace {

// a of (1): about the smallest singular value of A, for which the condition of the whole is A's
// [Björck 1996, §2.5.2].
constexpr double kDiagonal = 0.05;

}  // namespace

void SparseLeastNorm::Reset() {
  in_rows_.clear();
  lu_.Reset();
}

void SparseLeastNorm::MakePattern(const SparseLu::Matrix& A) {
  const auto unknowns = static_cast<int>(A.cols());
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < unknowns; ++i) {
    entries.emplace_back(i, i, kDiagonal);
    for (SparseLu::Matrix::InnerIterator entry(A, i); entry; ++entry) {
      const auto equation = static_cast<int>(unknowns + entry.row());
      entries.emplace_back(equation, i, 0.0);
      entries.emplace_back(i, equation, 0.0);
    }
  }
  K_.resize(A.cols() + A.rows(), A.cols() + A.rows());
  K_.setFromTriplets(entries.begin(), entries.end());
  K_.makeCompressed();
  const auto place = [&](int row, int column) {
    const int* first = K_.innerIndexPtr() + K_.outerIndexPtr()[column];
    const int* last = K_.innerIndexPtr() + K_.outerIndexPtr()[column + 1];
    return static_cast<int>(std::lower_bound(first, last, row) - K_.innerIndexPtr());
  };
  in_rows_.clear();
  in_columns_.clear();
  for (int i = 0; i < unknowns; ++i) {
    for (SparseLu::Matrix::InnerIterator entry(A, i); entry; ++entry) {
      const auto equation = static_cast<int>(unknowns + entry.row());
      in_columns_.push_back(place(equation, i));
      in_rows_.push_back(place(i, equation));
    }
  }
}

bool SparseLeastNorm::Factor(const SparseLu::Matrix& A, double tolerance) {
  A_ = A;
  if (in_rows_.empty()) MakePattern(A);
  for (Eigen::Index k = 0; k < A.nonZeros(); ++k) {
    K_.valuePtr()[in_columns_[static_cast<size_t>(k)]] = A.valuePtr()[k];
    K_.valuePtr()[in_rows_[static_cast<size_t>(k)]] = -A.valuePtr()[k];
  }
  return lu_.Factor(K_) && lu_.PivotRatio() > tolerance;
}

// Second passes are iterative refinement.
VecX SparseLeastNorm::LeastNorm(const VecX& b) const {
  VecX x = VecX::Zero(A_.cols()), rest = b, both(K_.rows());
  for (int pass = 0; pass < 2; ++pass) {
    both.setZero();
    both.tail(b.size()) = rest;
    lu_.Solve(&both);
    x += both.head(x.size());
    rest = b - A_ * x;
  }
  return x;
}

VecX SparseLeastNorm::LeastSquares(const VecX& c) const {
  VecX y = VecX::Zero(A_.rows()), rest = c, both(K_.rows());
  for (int pass = 0; pass < 2; ++pass) {
    both.setZero();
    both.head(c.size()) = rest;
    lu_.Solve(&both);
    y -= both.tail(y.size());
    rest = c - A_.transpose() * y;
  }
  return y;
}

}  // namespace mbv
