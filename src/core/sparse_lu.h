// LU factors of sparse square matrices of one pattern, by KLU [Davis and Palamadai Natarajan 2010].
#pragma once

#include <Eigen/SparseCore>
#include <memory>

#include "core/types.h"

namespace mbv {

/// P A Q = L U, block triangular where A can be made so. Ordering and pivots are chosen at the
/// first factorisation of a pattern and serve the later ones for as long as the factors do not
/// grow; then they are chosen anew.
class SparseLu {
 public:
  using Matrix = Eigen::SparseMatrix<double>;  ///< compressed

  SparseLu();
  ~SparseLu();
  SparseLu(SparseLu&&) noexcept;
  SparseLu& operator=(SparseLu&&) noexcept;

  /// Forgets the pattern; the next Factor() takes that of its matrix.
  void Reset();
  /// Factors A, of the pattern that the first call since Reset() had. False where A is singular as
  /// far as its pivots tell (one is exactly zero), or not finite.
  [[nodiscard]] bool Factor(const Matrix& A);
  /// −1 or 1; of the matrix factored last, in its own order of rows and columns.
  [[nodiscard]] int determinant_sign() const;

  /// Smallest over largest pivot: a cheap warning of a singular matrix.
  [[nodiscard]] double PivotRatio() const;

  /// In place: x with A x = b, and with Aᵀ x = b.
  void Solve(VecX* b) const;
  void SolveTransposed(VecX* b) const;

 private:
  struct Factors;
  std::unique_ptr<Factors> factors_;
};

}  // namespace mbv
