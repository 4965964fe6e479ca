// Constraint singularities inside a set of two dimensions: curves where the joints alone lose rank
// [Zlatanov, Bonev, Gosselin 2002], which the set passes unnoticed.
//
//   e = det [A_s; Nᵀ] / (its value at the set's start)                                         (1)
//
// A_s: rows of the loops (pose_space.h, 1) that are independent at home, N: the motions. N goes on
// smoothly through such a pose, A_s loses rank there, and e changes its sign. Between neighbours of
// the flooded lattice with different signs the pose where e vanishes is found along the straight
// line; nodes of one cell are joined. Poses where only the choice A_s is dependent are none.
#pragma once

#include <vector>

#include "features/workspace/reachable_set.h"

namespace mbv {

/// Arcs of two nodes each [m or rad], within a cell of the lattice. Empty of other dimensions.
[[nodiscard]] std::vector<TracedArc> ConstraintCurves(const SetQuestion& question,
                                                      const ReachableSet& set);

}  // namespace mbv
