// Rank of large sparse matrices by orthogonal elimination.
#pragma once

#include <Eigen/SparseCore>
#include <utility>
#include <vector>

#include "core/types.h"

namespace mbv {

/// QᵀA = R row by row with Givens rotations, columns in an order that keeps R sparse. Entries below
/// `tolerance` of the longest column's length count as zero; a column without a pivot depends on
/// the columns before it and is dropped [Heath 1982].
class SparseRank {
 public:
  using Matrix = Eigen::SparseMatrix<double>;  ///< compressed

  SparseRank(const Matrix& A, double tolerance);

  [[nodiscard]] int rank() const { return static_cast<int>(kept_.size()); }
  /// The columns kept: they span what A's columns span. Increasing.
  [[nodiscard]] std::vector<int> Independent() const;
  /// Singular values would say the same: with entries dropped of norm e, A has none between e and
  /// about the smallest of R.
  [[nodiscard]] bool clear() const { return clear_; }
  /// Estimate of the smallest singular value of the columns kept, and the Frobenius norm of all
  /// that was taken for zero: no singular value beyond the rank is larger.
  [[nodiscard]] double smallest_kept() const { return smallest_kept_; }
  [[nodiscard]] double dropped_norm() const { return dropped_norm_; }
  /// Columns × (columns − rank), A N = 0: of each dropped column what balances it among those kept;
  /// columns of unit length.
  [[nodiscard]] MatX NullSpace() const;

 private:
  using Row = std::vector<std::pair<int, double>>;  ///< (place of the column in the order, entry)
  void Eliminate(Row row);
  void Order(const Matrix& A);
  void Arrange();
  [[nodiscard]] double SmallestSingularValue() const;

  double limit_ = 0.0;
  std::vector<int> order_;           ///< column of A at each place
  std::vector<Row> R_;               ///< per place: the row that starts there, or none
  std::vector<int> kept_, dropped_;  ///< places
  Matrix R_kept_, R_dropped_;        ///< rank × rank, rank × dropped
  double smallest_kept_ = 0.0, dropped_norm_ = 0.0;
  bool clear_ = false;
};

}  // namespace mbv
