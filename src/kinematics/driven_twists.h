// What moves with what: the bodies' twists when driven coordinates move one at a time.
#pragma once

#include <vector>

#include "base/types.h"
#include "mechanism/mechanism.h"

namespace mbv {

struct DrivenTwists {
  /// Per drive, then per prescribed joint, and per body: the twist [ω; v of Bo] in world axes at
  /// one unit of this coordinate's rate, the other ones at rest. DOFs that nothing drives
  /// follow by inertia; coordinates that depend on each other share the motion with least rates.
  /// All zero where the coordinate is not held, or hardly moves anything at home.
  std::vector<std::vector<Vec6>> V_WB;
  /// Per body: it can move while the prescribed joints rest.
  std::vector<bool> moved;
};

/// At the home pose. `held[d]` is false for a drive whose motion is not given.
[[nodiscard]] DrivenTwists TwistsOfDriven(const Mechanism& mechanism,
                                          const std::vector<bool>& held);

}  // namespace mbv
