// Where the bodies of a mechanism are and how they move, in maximal coordinates.
#pragma once

#include <cstddef>
#include <vector>

#include "core/types.h"

namespace mbv {

/// Pose X_WB, twist V_WB = [ω; v of Bo] and acceleration A_WB = [ε; a of Bo] of every body, in
/// world axes (the classical acceleration of the origin, not the spatial one); index 0 (the world)
/// stays at rest.
struct BodyStates {
  std::vector<Pose> X_WB;
  std::vector<Vec6> V_WB;
  std::vector<Vec6> A_WB;

  /// Per term of the mechanism's couplings in order: a value of its coordinate within half a turn,
  /// which says how many turns an angle counts; empty: home (coupling_rows.h).
  std::vector<double> coupled;
  /// The same per force element, drive and prescribed joint (element_rows.h).
  std::vector<double> turns;

  void Resize(size_t bodies);
};

}  // namespace mbv
