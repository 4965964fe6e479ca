// LU factors of sparse square matrices of one pattern, by KLU [Davis and Palamadai Natarajan 2010].
#pragma once

#include <Eigen/SparseCore>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "base/types.h"

namespace mbv {

/// P A Q = L U, block triangular where A can be made so. Ordering and pivots are chosen at the
/// first factorisation of a pattern and serve the later ones for as long as the factors do not
/// grow; then they are chosen anew.
class SparseLu {
 public:
  using Matrix = Eigen::SparseMatrix<double>;  ///< compressed

  enum class Pivots {
    kAny,       ///< rows that keep factors small and stable
    kDiagonal,  ///< of positive definite matrices
  };
  explicit SparseLu(Pivots pivots = Pivots::kAny);
  ~SparseLu();
  SparseLu(SparseLu&&) noexcept;
  SparseLu& operator=(SparseLu&&) noexcept;

  /// Forgets the pattern; the next Factor() takes that of its matrix.
  void Reset();
  /// Factors A, of the pattern that the first call since Reset() had. False where A is singular as
  /// far as its pivots show (one is exactly zero), or not finite.
  [[nodiscard]] bool Factor(const Matrix& A);
  /// −1 or 1; of the matrix factored last, in its own order of rows and columns.
  [[nodiscard]] int determinant_sign() const;

  /// Smallest over largest pivot: a cheap warning of a singular matrix.
  [[nodiscard]] double PivotRatio() const;
  /// Of both factors, which is what they cost.
  [[nodiscard]] double entries() const;

  /// In place: x with A x = b, and with Aᵀ x = b.
  void Solve(VecX* b) const;
  void SolveTransposed(VecX* b) const;

 private:
  struct Factors;
  std::unique_ptr<Factors> factors_;
};

// Rank of large sparse matrices by orthogonal elimination.

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
  /// As many that span the same, chosen so that none of the others is a combination of them with a
  /// coefficient above 2: their smallest singular value is close to the largest that a choice can
  /// have [Gu and Eisenstat 1996], where that of the columns kept, which their order decides, may
  /// be any. Increasing.
  [[nodiscard]] std::vector<int> FirmlyIndependent() const;
  /// Singular values would say the same: with entries dropped of norm e, A has none between e and
  /// about the smallest of R.
  [[nodiscard]] bool clear() const { return clear_; }
  /// Estimate of the smallest singular value of the columns kept, or where these are a poor choice
  /// of all beyond the zeros; and a bound of what was taken for zero: its Frobenius norm, or what A
  /// does to its null space. No singular value beyond the rank is larger.
  [[nodiscard]] double smallest_kept() const { return smallest_kept_; }
  [[nodiscard]] double dropped_norm() const { return dropped_norm_; }
  /// Columns × (columns − rank), A N = 0: of each dropped column what balances it among those kept;
  /// columns of unit length.
  [[nodiscard]] MatX NullSpace() const;
  /// x with AᵀA x = b and zeros at the columns dropped, for b that is a combination of A's rows.
  [[nodiscard]] VecX SolveNormal(const VecX& b) const;

 private:
  using Row = std::vector<std::pair<int, double>>;  ///< (place of the column in the order, entry)
  void Eliminate(Row row);
  void Order(const Matrix& A);
  void Arrange();
  [[nodiscard]] std::vector<int> ColumnsAt(const std::vector<int>& places) const;
  [[nodiscard]] double SmallestSingularValue() const;
  [[nodiscard]] double SmallestOfAll() const;
  [[nodiscard]] MatX Coefficients() const;

  double limit_ = 0.0;
  std::vector<int> order_;           ///< column of A at each place
  std::vector<Row> R_;               ///< per place: the row that starts there, or none
  std::vector<int> kept_, dropped_;  ///< places
  Matrix R_kept_, R_dropped_;        ///< rank × rank, rank × dropped
  double smallest_kept_ = 0.0, dropped_norm_ = 0.0;
  bool clear_ = false;
};

// Minima of quadratic forms under linear constraints, sparse: least norm, least squares, equations
// of motion.

/// x with least ½ xᵀW x − cᵀx among those with B x = b, and the multipliers y:
///   [W  −Bᵀ] [x]   [c]
///   [B    0] [y] = [b] (1)
/// for symmetric W, definite where B x = 0; its factors are about as sparse as W and B.
class SparseSaddle {
 public:
  using Matrix = SparseLu::Matrix;

  /// Always with the same patterns since the last Reset(); B is given as its transpose. False where
  /// (1) is singular as far as pivots show: one is below `tolerance` of the largest.
  [[nodiscard]] bool Factor(const Matrix& W, const Matrix& B_transposed, double tolerance);
  void Reset();

  void Solve(const VecX& c, const VecX& b, VecX* x, VecX* y, int refinements = 1) const;
  /// Of the factors.
  [[nodiscard]] double entries() const { return lu_.entries(); }

 private:
  void MakePattern(const Matrix& W, const Matrix& B_transposed);

  Matrix K_;  ///< of (1)
  std::vector<int> of_W_, in_rows_,
      in_columns_;  ///< per entry of W and of B: where it stands in K_
  SparseLu lu_;
  mutable VecX right_, both_, rest_;  ///< of the last Solve()
};

/// For A of full row rank: x of least norm with A x = b, and y with least |Aᵀ y − c| [Björck 1996,
/// §2.5.2]. By the factors of SparseSaddle, or of A Aᵀ where these are much smaller, as of nets,
/// and A is conditioned well enough that refinement makes up for the square.
class SparseLeastNorm {
 public:
  /// As SparseSaddle::Factor(), with the same patterns since the last Reset().
  [[nodiscard]] bool Factor(const SparseLu::Matrix& A, double tolerance);
  void Reset() {
    A_.resize(0, 0);
    saddle_.Reset();
    normal_.Reset();
  }

  [[nodiscard]] VecX LeastNorm(const VecX& b) const;
  [[nodiscard]] VecX LeastSquares(const VecX& c, int refinements = 1) const;

 private:
  void MakePattern(const SparseLu::Matrix& A);
  [[nodiscard]] bool FactorNormal(const SparseLu::Matrix& A);
  void SolveNormal(const VecX& c, const VecX& b, VecX* x, VecX* y, int refinements) const;

  enum class Way { kUndecided, kSaddle, kNormal };
  Way way_ = Way::kSaddle;
  SparseLu::Matrix A_, weight_;  ///< Aᵀ, W
  SparseLu::Matrix squares_;     ///< A Aᵀ
  SparseLu normal_{SparseLu::Pivots::kDiagonal};
  VecX column_;            ///< of squares_
  std::vector<int> from_;  ///< per entry of Aᵀ: which one of A
  VecX zero_cols_, zero_rows_;
  mutable VecX x_, y_, rest_c_, rest_b_;
  SparseSaddle saddle_;
};

/// [A; B; …], each given as its transpose: columns side by side.
[[nodiscard]] SparseLu::Matrix SideBySide(const std::vector<const SparseLu::Matrix*>& parts);

/// A singular value with its right vector, of unit length.
struct SingularPair {
  double value = kNan;
  VecX vector;
  bool converged = false;  ///< to about 1e-10 of the value
};
/// The least singular value that C has where G x = 0, by Lanczos' iteration on the inverse
/// [Golub and Van Loan 2013, §10.1]. C and G are given as their transposes; the rows of G are
/// independent of each other. `project`, where given, takes out of vectors, orthogonally, what
/// singular vectors span that are not meant. NaN where the factors fail.
[[nodiscard]] SingularPair LeastSingular(const SparseLu::Matrix& C_transposed,
                                         const SparseLu::Matrix& G_transposed,
                                         const std::function<void(VecX*)>& project = nullptr);

}  // namespace mbv
