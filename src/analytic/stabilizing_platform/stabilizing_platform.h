// The stabilizing platform's closed form behind the common interface.
#pragma once

#include "analytic/closed_form.h"

namespace mbv::stabilizing_platform {

/// Factory for registry.cc. Needs the parameters listed in parameters.h, drives limb1.drive,
/// limb1.drive_p … limb3.drive_p, prescribed roll, pitch, heave, and an output "platform".
///
/// Commands: roll, pitch and heave, and either platform.z, platform.roll = 0, platform.pitch = 0
/// and three equal pairs of drives (synchronous, the paper's case), or all six of platform.x … yaw
/// (six independent drives). Loads may act on the platform and on links; those on the ship's
/// bodies do not change the drives. Anything else becomes a finding.
///
/// Extra channels: platform.* and platform_in_base.* poses; limbN.length, limbN.amplification
/// (synchronous only), limbN.f_X, .f_Y, .f_Z (force of the limb on the platform in {A_N}); and in
/// all models but paper_text the reactions of U1, U1_p, R12, R12_p, R22 and S that the isostatic
/// rule makes definite, where the mechanism has these joints.
[[nodiscard]] std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism,
                                                         const Motion& motion,
                                                         const ClosedFormOptions& options,
                                                         Diagnostics* diagnostics);

}  // namespace mbv::stabilizing_platform
