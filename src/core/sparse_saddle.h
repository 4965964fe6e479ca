// Minima of quadratic forms under linear constraints, sparse: least norm, least squares, equations
// of motion.
#pragma once

#include <vector>

#include "core/sparse_lu.h"
#include "core/types.h"

namespace mbv {

/// x with least ½ xᵀW x − cᵀx among those with B x = b, and the multipliers y:
///   [W  −Bᵀ] [x]   [c]
///   [B    0] [y] = [b] (1)
/// for symmetric W, definite where B x = 0; its factors are about as sparse as W and B.
class SparseSaddle {
 public:
  using Matrix = SparseLu::Matrix;

  /// Always with the same patterns since the last Reset(); B is given as its transpose. False where
  /// (1) is singular as far as pivots tell: one is below `tolerance` of the largest.
  [[nodiscard]] bool Factor(const Matrix& W, const Matrix& B_transposed, double tolerance);
  void Reset();

  void Solve(const VecX& c, const VecX& b, VecX* x, VecX* y, int refinements = 1) const;

 private:
  void MakePattern(const Matrix& W, const Matrix& B_transposed);

  Matrix K_;  ///< of (1)
  std::vector<int> of_W_, in_rows_,
      in_columns_;  ///< per entry of W and of B: where it stands in K_
  SparseLu lu_;
  mutable VecX right_, both_, rest_;  ///< of the last Solve()
};

/// For A of full row rank: x of least norm with A x = b, and y with least |Aᵀ y − c| [Björck 1996,
/// §2.5.2].
class SparseLeastNorm {
 public:
  /// As SparseSaddle::Factor(), with the same patterns since the last Reset().
  [[nodiscard]] bool Factor(const SparseLu::Matrix& A, double tolerance);
  void Reset() {
    A_.resize(0, 0);
    saddle_.Reset();
  }

  [[nodiscard]] VecX LeastNorm(const VecX& b) const;
  [[nodiscard]] VecX LeastSquares(const VecX& c, int refinements = 1) const;

 private:
  void MakePattern(const SparseLu::Matrix& A);

  SparseLu::Matrix A_, weight_;  ///< Aᵀ, W
  std::vector<int> from_;        ///< per entry of Aᵀ: which one of A
  VecX zero_cols_, zero_rows_;
  mutable VecX x_, y_;
  SparseSaddle saddle_;
};

}  // namespace mbv
