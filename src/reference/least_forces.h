// Which of many possible sets of forces is reported. Internal to reference/.
#pragma once

#include "core/sparse_saddle.h"
#include "core/types.h"

namespace mbv::internal {

/// Where statics leaves a choice, one set of forces is taken: first the norm of the driven forces
/// (drives and prescribed joints) is made least, then that of all forces. `self_stress` (forces ×
/// k) spans the forces that balance each other; `first_driven` and all later rows are driven.
/// All forces in N: moments divided by the characteristic length.
void TakeLeastForces(const MatX& self_stress, Eigen::Index first_driven, VecX* force);

/// Whether a self-stress acts on forces from `first` on, where `forces` solves A x = b for forces
/// x: a random self-stress has a share in all that one acts on.
[[nodiscard]] bool SelfStressReaches(const SparseLeastNorm& forces, const SparseLu::Matrix& A,
                                     Eigen::Index first);

}  // namespace mbv::internal
