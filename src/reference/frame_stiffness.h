// Stiffness as the linear statics of a 3D frame of Euler–Bernoulli beams, rigid bodies and ideal
// joints, for any Mechanism with beams or servos. No formula of a paper.
#pragma once

#include <vector>

#include "core/stiffness.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Stiffness of output `output` with all drives held by their servos, in the pose X_WB (one pose
/// per body, loops closed), relative to the output's reference body, in world axes. Bodies with
/// beams move by their beam ends, all others are rigid; distance drives and springs act along their
/// lines; weights and preloads have no influence. Shares are those of the beams, then of the servos
/// ("DRIVE (servo)") and springs ("NAME (spring)") that are not rigid.
///
/// kSingular with K and rank where the output is free to move (`where`: the joint that moves most;
/// C is NaN), and with C alone where nothing elastic lies in the way of some load (K is infinite).
/// kUnsupported for a model without beams and servos, or where the output or a joint sits on an
/// elastic body beside its beam ends.
[[nodiscard]] StiffnessResult FrameStiffness(const Mechanism& mechanism,
                                             const std::vector<Pose>& X_WB, int output);

}  // namespace mbv
