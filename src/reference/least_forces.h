// Which of many possible sets of forces is reported. Internal to reference/.
#pragma once

#include <vector>

#include "core/sparse_lu.h"
#include "core/types.h"

namespace mbv::internal {

/// Where statics leaves a choice, one set of forces is taken: first the norm of the driven forces
/// (drives and prescribed joints) is made least, then that of all forces. `self_stress` (forces ×
/// k) spans the forces that balance each other; `first_driven` and all later rows are driven.
/// All forces in N: moments divided by the characteristic length.
void TakeLeastForces(const MatX& self_stress, Eigen::Index first_driven, VecX* force);

/// The forces of least norm alone, for many self-stresses: x with A x = b and x = Aᵀ y, from
///   [a 1  −Aᵀ] [x  ]   [0]
///   [A     0 ] [a y] = [b] (1)
/// whose factors are about as sparse as A's [Björck 1996, §2.5.2].
class SparseLeastForces {
 public:
  /// A: equations × forces, of full row rank; always with the same pattern. False where it is
  /// singular.
  [[nodiscard]] bool Factor(const SparseLu::Matrix& A);
  [[nodiscard]] VecX Solve(const VecX& b) const;
  /// Whether a self-stress acts on forces from `first` on: a random one has a share in all of them.
  [[nodiscard]] bool SelfStressReaches(Eigen::Index first) const;

 private:
  void MakePattern(const SparseLu::Matrix& A);

  const SparseLu::Matrix* A_ = nullptr;
  SparseLu::Matrix K_;                     ///< of (1)
  std::vector<int> in_rows_, in_columns_;  ///< per entry of A: where it stands in K_
  SparseLu lu_;
};

}  // namespace mbv::internal
