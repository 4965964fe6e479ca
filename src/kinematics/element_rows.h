// Coordinates of force elements as rows, and which turn their angles and those of drives are in.
#pragma once

#include <vector>

#include "kinematics/constraints.h"

namespace mbv {

/// The coordinates of all force elements at poses, in the turns that `states.turns` tells, with
/// velocities for the bias.
[[nodiscard]] std::vector<ScalarRow> ElementRows(const Mechanism& mechanism,
                                                 const BodyStates& states);
/// The same of drives, then of prescribed joints.
[[nodiscard]] std::vector<ScalarRow> DrivenRows(const Mechanism& mechanism,
                                                const BodyStates& states);

/// Brings the elements' part of `states->turns` to the poses, which lie within half a turn of those
/// it was last brought to (or of home).
void FollowElements(const Mechanism& mechanism, BodyStates* states);
/// The same for drives and prescribed joints.
void FollowDriven(const Mechanism& mechanism, BodyStates* states);

/// What `states->coupled` and `states->turns` are likely to be `dt_s` later, by velocities and
/// accelerations. To be called before the poses are moved there, where angles may turn by more than
/// half a turn.
void PredictTurns(const Mechanism& mechanism, double dt_s, BodyStates* states);

}  // namespace mbv
