// The springs of a compliant model in its MJCF text.
#pragma once

#include <string>

#include "mjcf/compliant.h"

namespace mbv::mjcf {

/// The writer's text with the stiffness of the joint springs (those of tendons are there). Their
/// coordinates count from the given pose, so that they are deformations: the rounding of an angle
/// of 1 rad, times the servo's stiffness, would unbalance small loads.
[[nodiscard]] std::string TextWithSprings(const CompliantModel& model);

}  // namespace mbv::mjcf
