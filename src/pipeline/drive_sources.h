// Motion and forces of the drives for a simulation, computed at any time by another witness.
#pragma once

#include <memory>

#include "analytic/closed_form.h"
#include "simulation/simulation.h"

namespace mbv {

/// Motion of everything driven, computed by the closed form or by the reference. `mechanism` and
/// `motion` must outlive what is returned.
[[nodiscard]] DrivenMotion DriveByClosedForm(const Motion& motion,
                                             std::shared_ptr<ClosedForm> closed_form);
[[nodiscard]] DrivenMotion DriveByReference(const Mechanism& mechanism, const Motion& motion);
/// Of a free motion: commanded drives and prescribed joints; the other entries are 0.
[[nodiscard]] DrivenMotion DriveByCommands(const Mechanism& mechanism, const Motion& motion);

/// Drive forces for the commanded motion, computed by the closed form or by the reference.
[[nodiscard]] DriveForces ForcesByClosedForm(const Motion& motion,
                                             std::shared_ptr<ClosedForm> closed_form);
[[nodiscard]] DriveForces ForcesByReference(const Mechanism& mechanism, const Motion& motion);

}  // namespace mbv
