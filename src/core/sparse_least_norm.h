// Least-norm and least-squares solutions with a sparse matrix.
#pragma once

#include <vector>

#include "core/sparse_lu.h"
#include "core/types.h"

namespace mbv {

/// For A of full row rank: x of least norm with A x = b, and y with least |Aᵀ y − c|, both from
///   [a 1  −Aᵀ] [x  ]   [c]
///   [A     0 ] [a y] = [b] (1)
/// whose factors are about as sparse as A's [Björck 1996, §2.5.2].
class SparseLeastNorm {
 public:
  /// Always with the same pattern since the last Reset(). False where A has not full row rank as
  /// far as pivots tell: one is below `tolerance` of the largest.
  [[nodiscard]] bool Factor(const SparseLu::Matrix& A, double tolerance);
  void Reset();

  [[nodiscard]] VecX LeastNorm(const VecX& b) const;
  [[nodiscard]] VecX LeastSquares(const VecX& c) const;

 private:
  void MakePattern(const SparseLu::Matrix& A);

  SparseLu::Matrix A_, K_;                 ///< of (1)
  std::vector<int> in_rows_, in_columns_;  ///< per entry of A: where it stands in K_
  SparseLu lu_;
};

}  // namespace mbv
