// What rows over all bodies hold and leave. Internal to reference/.
//
// With the scaled Jacobian J of all rows, of which k are independent of each other:
//   J B = 0, BᵀB = 1   (the motions left)                                                     (1)
//   V = J⁺ r           (of least norm with J V = r)                                            (2)
// Of few bodies by QR of Jᵀ with column pivoting. Of many by sparse QR of J (math/sparse.h), where
// JᵀJ V = Jᵀr is solved by its R and refined, and its null space made orthonormal; the smallest
// singular values follow from inverse iteration beside B. Sparse factors choose no rows. Where the
// rank is not the one expected, QR with pivoting decides.
#pragma once

#include <Eigen/QR>
#include <optional>
#include <vector>

#include "base/types.h"
#include "math/sparse.h"
#include "reference/row_set.h"
#include "reference/square_system.h"

namespace mbv::internal {

/// Unknowns up to which dense factors are cheaper.
inline constexpr int kMostDense = 120;

class RowFactors {
 public:
  /// Rows that leave `dofs` motions. Systems of more than `largest_dense` unknowns are sparse.
  RowFactors(size_t bodies, double length, int dofs, int largest_dense = kMostDense);

  void Factor(const RowSet& rows);

  /// Size of the weakest of the rows expected to be independent, over the largest: of many bodies
  /// the smallest singular value, of few the last pivot. 0 where a constraint is lost.
  [[nodiscard]] double pivot() const { return pivot_; }
  /// The first pivot beyond them, over the largest: such a row contradicts `dofs`.
  [[nodiscard]] double extra() const { return extra_; }
  /// The motion that the weakest row holds, in world units, where there is one.
  [[nodiscard]] VecX WeakestMotion() const;
  /// (2) in world units, of rates per row [m/s, rad/s]; `firm`: without rows that are weak.
  [[nodiscard]] VecX LeastMotion(const VecX& rates, bool firm) const;
  /// B, in world units.
  [[nodiscard]] MatX Motions() const { return system_.body_scale().asDiagonal() * Basis(); }
  /// The share of a scalar's gradient (6·bodies) along B.
  [[nodiscard]] double ShareLeft(const VecX& gradient) const;
  /// As many independent rows as were expected, increasing; none where there are fewer.
  [[nodiscard]] std::vector<int> IndependentRows(const RowSet& rows) const;

 private:
  [[nodiscard]] bool FactorSparse();
  void FactorDense();
  [[nodiscard]] VecX WithoutBasis(const VecX& V) const;
  [[nodiscard]] const MatX& Basis() const;

  SquareSystem system_;  ///< for its scales
  const int dofs_, largest_dense_;
  Eigen::Index independent_ = 0;  ///< rows expected to be
  VecX row_scale_;
  SparseLu::Matrix columns_;             ///< scaled Jᵀ
  std::optional<SparseRank> sparse_;     ///< of J
  Eigen::ColPivHouseholderQR<MatX> qr_;  ///< of Jᵀ, where sparse_ is not in use
  mutable MatX basis_;                   ///< B; empty: not made yet
  VecX soft_;                            ///< with sparse_: what the weakest row holds
  MatX weak_;                            ///< with sparse_: motions that weak rows alone hold
  double pivot_ = kNan, extra_ = 0.0;
};

}  // namespace mbv::internal
