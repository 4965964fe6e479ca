// Stiffness by the direct stiffness method: a 3D frame of Euler–Bernoulli beams, rigid bodies and
// ideal joints, for any Mechanism with beams.
#pragma once

#include <vector>

#include "core/stiffness.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Stiffness of output `output` with all drives held by their servos, in the pose X_WB (one pose
/// per body, loops closed). kUnsupported for a model without beams and servos.
[[nodiscard]] StiffnessResult FrameStiffness(const Mechanism& mechanism,
                                             const std::vector<Pose>& X_WB, int output);

}  // namespace mbv
