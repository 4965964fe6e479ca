// Coordinates of force elements as rows.
#pragma once

#include <vector>

#include "kinematics/constraints.h"

namespace mbv {

/// The coordinates of all force elements at poses, in the turns that `states.sprung` tells, with
/// velocities for the bias.
[[nodiscard]] std::vector<ScalarRow> ElementRows(const Mechanism& mechanism,
                                                 const BodyStates& states);

/// Brings `states->sprung` to the poses, which lie within half a turn of those it was last brought
/// to (or of home).
void FollowElements(const Mechanism& mechanism, BodyStates* states);

}  // namespace mbv
