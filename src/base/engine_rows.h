// Equality rows of a MuJoCo model at given states, as one version of the engine has them: what two
// versions are compared by.
#pragma once

#include <string>
#include <vector>

#include "base/types.h"

namespace mbv {

/// A state at which rows are looked at, in MuJoCo's coordinates.
struct RowState {
  VecX qpos, qvel;
  VecX targets;  ///< what drives and prescribed joints are held at [m or rad]
  VecX applied;  ///< generalized forces of loads and of what MuJoCo lacks: qfrc_applied
};

/// What one version makes of a state. A row's reference acceleration is
///   aref = −k r − b J q̇ − β,   and would have to have β = J̇q̇.                              (1)
struct RowMeasures {
  VecX R;      ///< per row: softness
  VecX bias;   ///< per row: β of (1) [m/s², rad/s², halves of them in the rotations of welds]
  VecX force;  ///< per drive and prescribed joint, by mj_forward [N or N m]
};

}  // namespace mbv
