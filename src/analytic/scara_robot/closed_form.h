// The closed form of the SCARA parallel robot as a witness.
#pragma once

#include "analytic/closed_form.h"
#include "analytic/coverage.h"

namespace mbv::scara_robot {

/// Driven in joint space (commands on all four drives; the forward position starts from the pose
/// home_x, home_y, home_z, home_phi) or in task space (platform.x, .y, .z, .yaw). Loads act on the
/// body "platform". Models: "full", "thin_rods" (the paper's rods without spin).
/// Extra channels: platform.x … platform.yaw, singularity.s_min, singularity.det,
/// singularity.near (1 where s_min < kNearlySingular: usable with care, else 0) and, per limb,
/// limbN.dead_point (V), limbN.rod_shear, limbN.rod_tilt; and the forces in the joints limbN.motor,
/// .pivot (limbs 1, 2), .wrist and .ball_B (limbs 3, 4), where the mechanism has them.
[[nodiscard]] std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism,
                                                         const Motion& motion,
                                                         const ClosedFormOptions& options,
                                                         Diagnostics* diagnostics);

// What the equations of the SCARA parallel robot take for granted.

/// Motors at 90 degrees, arms in radial planes, two limbs of two equal rods with a cross-bar and
/// two of one rod, the platform level; rods of the shared bearings' masses (ball_mass, pivot_mass;
/// 0 where the model has none). Only what moves the drives counts: the platform turns about z, arms
/// about their motors, the bars not at all.
[[nodiscard]] Coverage CoverageOf(const Mechanism& mechanism);

/// Of the stiffness: arms, rods and short rods are beams of one round section, the parallelograms
/// R-Pa-R, the servos springs.
[[nodiscard]] Coverage StiffnessCoverageOf(const Mechanism& mechanism);

}  // namespace mbv::scara_robot
