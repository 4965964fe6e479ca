#include "core/sparse_rank.h"

#include <Eigen/OrderingMethods>
#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// How far the estimated smallest singular value must be above the tolerance.
constexpr double kClear = 100.0;
// Inverse iterations that estimate a singular value.
constexpr int kIterations = 6;

double LongestColumn(const SparseRank::Matrix& A) {
  double longest = 0.0;
  for (int c = 0; c < A.cols(); ++c) longest = std::max(longest, A.col(c).norm());
  return longest;
}

// Sums of two sparse rows, (c x + s y, −s x + c y).
template <typename Row>
std::pair<Row, Row> Rotated(const Row& x, const Row& y, double c, double s) {
  std::pair<Row, Row> out;
  out.first.reserve(x.size() + y.size());
  out.second.reserve(x.size() + y.size());
  auto a = x.begin();
  auto b = y.begin();
  while (a != x.end() || b != y.end()) {
    const bool in_x = a != x.end() && (b == y.end() || a->first <= b->first);
    const bool in_y = b != y.end() && (a == x.end() || b->first <= a->first);
    const int at = in_x ? a->first : b->first;
    const double from_x = in_x ? (a++)->second : 0.0, from_y = in_y ? (b++)->second : 0.0;
    out.first.emplace_back(at, c * from_x + s * from_y);
    out.second.emplace_back(at, c * from_y - s * from_x);
  }
  out.second.erase(out.second.begin());  // rotated away
  return out;
}

}  // namespace

SparseRank::SparseRank(const Matrix& A, double tolerance) {
  limit_ = tolerance * LongestColumn(A);
  Order(A);
  R_.resize(order_.size());
  std::vector<int> place(order_.size());
  for (size_t k = 0; k < order_.size(); ++k)
    place[static_cast<size_t>(order_[k])] = static_cast<int>(k);
  const Eigen::SparseMatrix<double, Eigen::RowMajor> by_rows = A;
  std::vector<Row> rows;
  for (int i = 0; i < by_rows.rows(); ++i) {
    Row row;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(by_rows, i); entry;
         ++entry) {
      row.emplace_back(place[static_cast<size_t>(entry.col())], entry.value());
    }
    std::sort(row.begin(), row.end());
    if (!row.empty()) rows.push_back(std::move(row));
  }
  // Rows that reach least far to the right first: what is rotated stays short.
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.back().first < b.back().first; });
  for (Row& row : rows) Eliminate(std::move(row));
  for (size_t place = 0; place < R_.size(); ++place) {
    (R_[place].empty() ? dropped_ : kept_).push_back(static_cast<int>(place));
  }
  Arrange();
}

void SparseRank::Order(const Matrix& A) {
  order_.resize(static_cast<size_t>(A.cols()));
  if (A.cols() == 0) return;
  const Matrix pattern = Matrix(A.transpose()) * A;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  for (Eigen::Index k = 0; k < A.cols(); ++k) {
    order_[static_cast<size_t>(k)] = permutation.indices()[k];
  }
}

// Rotates the row into R until nothing is left of it. Pivots only grow.
void SparseRank::Eliminate(Row row) {
  while (!row.empty()) {
    const auto [place, entry] = row.front();
    if (std::abs(entry) <= limit_) {
      dropped_norm_ = std::hypot(dropped_norm_, entry);
      row.erase(row.begin());
      continue;
    }
    Row& pivot = R_[static_cast<size_t>(place)];
    if (pivot.empty()) {
      pivot = std::move(row);
      return;
    }
    const double r = std::hypot(pivot.front().second, entry);
    auto [rotated, rest] = Rotated(pivot, row, pivot.front().second / r, entry / r);
    pivot = std::move(rotated);
    row = std::move(rest);
  }
}

void SparseRank::Arrange() {
  std::vector<int> within(R_.size(), -1);  // the place among those kept, or those dropped
  for (size_t k = 0; k < kept_.size(); ++k)
    within[static_cast<size_t>(kept_[k])] = static_cast<int>(k);
  for (size_t k = 0; k < dropped_.size(); ++k)
    within[static_cast<size_t>(dropped_[k])] = static_cast<int>(k);
  std::vector<Eigen::Triplet<double>> square, rest;
  for (size_t k = 0; k < kept_.size(); ++k) {
    const Row& row = R_[static_cast<size_t>(kept_[k])];
    for (const auto& [place, entry] : row) {
      const bool is_kept = !R_[static_cast<size_t>(place)].empty();
      (is_kept ? square : rest)
          .emplace_back(static_cast<int>(k), within[static_cast<size_t>(place)], entry);
    }
  }
  const auto n = static_cast<Eigen::Index>(kept_.size());
  R_kept_.resize(n, n);
  R_kept_.setFromTriplets(square.begin(), square.end());
  R_dropped_.resize(n, static_cast<Eigen::Index>(dropped_.size()));
  R_dropped_.setFromTriplets(rest.begin(), rest.end());
  R_.clear();
  smallest_kept_ = SmallestSingularValue();
  clear_ = dropped_norm_ <= limit_ && (n == 0 || smallest_kept_ > kClear * limit_);
}

std::vector<int> SparseRank::Independent() const {
  std::vector<int> columns;
  for (const int place : kept_) columns.push_back(order_[static_cast<size_t>(place)]);
  std::sort(columns.begin(), columns.end());
  return columns;
}

double SparseRank::SmallestSingularValue() const {
  VecX x(R_kept_.cols());
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = 1.0 + 0.5 * std::sin(1.7 * static_cast<double>(i));  // a share in every direction
  }
  double sigma = 0.0;
  for (int i = 0; i < kIterations; ++i) {
    x.normalize();
    R_kept_.triangularView<Eigen::Upper>().solveInPlace(x);
    R_kept_.transpose().triangularView<Eigen::Lower>().solveInPlace(x);
    sigma = 1.0 / std::sqrt(x.norm());
  }
  return std::isfinite(sigma) ? sigma : 0.0;
}

MatX SparseRank::NullSpace() const {
  MatX N = MatX::Zero(static_cast<Eigen::Index>(order_.size()),
                      static_cast<Eigen::Index>(dropped_.size()));
  for (size_t k = 0; k < dropped_.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    VecX balance = -VecX(R_dropped_.col(column));
    R_kept_.triangularView<Eigen::Upper>().solveInPlace(balance);
    for (size_t i = 0; i < kept_.size(); ++i) {
      N(order_[static_cast<size_t>(kept_[i])], column) = balance[static_cast<Eigen::Index>(i)];
    }
    N(order_[static_cast<size_t>(dropped_[k])], column) = 1.0;
    N.col(column).normalize();
  }
  return N;
}

}  // namespace mbv
