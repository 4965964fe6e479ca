// The 3-SPR mechanism's closed form as a witness (see geometry.h for frames and terms).
//
// Motion: either platform.x, platform.y, platform.z (position of O_A in the world), or the three
// leg lengths. Loads may act on any of the seven moving bodies. Stroke limits are not checked here;
// the formulas hold beyond them.
//
// Extra channels:
//   platform.x … platform.yaw          pose of the platform, as the output's
//   legN.S.reaction.fx, fy, fz         force of the base on leg N at B_N, axes of the ball joint
//   tilt [rad]                         θ, angle between the platform's and the base's normal
//   legN.spin [rad/s]                  turning of leg N about its own axis, (19)
//   jacobian.det                       det J of (14), 1.1 … 1.9 in the workspace
#pragma once

#include <memory>

#include "analytic/closed_form.h"
#include "analytic/coverage.h"

namespace mbv::spr_tripod {

/// Factory for the registry. The mechanism must have joints legN.S (world – cylinder), legN.P
/// (cylinder – rod), legN.R (rod – platform), drives on legN.P in order of N, and the parameters
/// that spr_tripod::ReadGeometry and ReadMasses name.
[[nodiscard]] std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism,
                                                         const Motion& motion,
                                                         const ClosedFormOptions& options,
                                                         Diagnostics* diagnostics);

// What the equations of the 3-SPR mechanism take for granted.

/// Three equal legs at 120, −120 and 0 degrees with tangential hinges; any inertias.
[[nodiscard]] Coverage CoverageOf(const Mechanism& mechanism);

}  // namespace mbv::spr_tripod
