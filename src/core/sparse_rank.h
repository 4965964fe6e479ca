// Rank of large sparse matrices by QR, columns that depend on others last.
#pragma once

#include <Eigen/SparseCore>
#include <memory>
#include <vector>

#include "core/types.h"

namespace mbv {

/// A P = Q R by Householder reflections in an order that keeps R sparse. A column of which less
/// than `tolerance` of the longest column's length is left by those before it is dropped.
class SparseRank {
 public:
  using Matrix = Eigen::SparseMatrix<double>;

  SparseRank(const Matrix& A, double tolerance);
  ~SparseRank();
  SparseRank(SparseRank&&) noexcept;

  [[nodiscard]] int rank() const;
  /// The columns kept: they span what A's columns span. Increasing.
  [[nodiscard]] std::vector<int> Independent() const;
  /// What is kept and what is dropped lie on either side of the tolerance by a factor of 1000, and
  /// the smallest singular value of the kept columns by one of 10: singular values say the same.
  [[nodiscard]] bool clear() const { return clear_; }
  /// Estimate of the smallest singular value of the columns kept, and the longest part of a dropped
  /// one that they do not span.
  [[nodiscard]] double smallest_kept() const { return smallest_kept_; }
  [[nodiscard]] double largest_dropped() const { return largest_dropped_; }
  /// Orthonormal: rows × (rows − rank), what A's columns do not span.
  [[nodiscard]] MatX Complement() const;

 private:
  struct Factors;
  [[nodiscard]] double SmallestSingularValue() const;
  [[nodiscard]] double LongestRest(const Matrix& A) const;

  std::unique_ptr<Factors> factors_;
  double smallest_kept_ = 0.0, largest_dropped_ = 0.0;
  bool clear_ = false;
};

}  // namespace mbv
