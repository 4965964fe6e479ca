// Overconstrained loops from rounded data.
//
// A loop with redundant constraints (a planar four-bar in space, Bennett's or Bricard's linkage)
// closes and moves only because its dimensions fit exactly. Data rounded to a few digits leave it
// open by the rounding. The projection moves the joint frames by as little as makes the loops close
// again, all along the motion: the frames are the same in several poses, and each of those must
// close.
#pragma once

#include "mechanism/mechanism.h"

namespace mbv {

struct DataProjection {
  /// Constraints that are redundant but for a gap of this size at home; 0: the loops are open for
  /// another reason.
  int redundant = 0;
  bool closed = false;       ///< the joint frames were moved, and home is solved with them
  double moved_m = kNan;     ///< largest displacement of a joint frame
  double turned_rad = kNan;  ///< largest turn
};

/// Constraints that are redundant but for `gap` [characteristic lengths, rad] at X_WB_home, the
/// pose of least gap.
[[nodiscard]] int CountNearlyRedundant(const Mechanism& mechanism, double gap);

/// Moves the joint frames X_PF, X_CM of a mechanism whose home solution left `gap`.
[[nodiscard]] DataProjection ProjectData(Mechanism* mechanism, double gap);

}  // namespace mbv
