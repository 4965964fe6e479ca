// The parts of making a user's model ready, in the order in which they are done. Internal to
// simulation/.
#pragma once

#include <string>

#include "simulation/own_model.h"

namespace mbv::simulation {

/// The file's own step, integrator, solver and settings of closures, as facts.
void TellSettings(OwnModel* own);
/// Finds what leads each drive; switches off what the mechanism does not have and what would push
/// against the commanded motion.
void FindLeads(const OwnTask& task, const ImportedMjcf& imported, OwnModel* own);
/// Holds free bodies and changes what the task's settings say.
void TakeSettings(const OwnTask& task, OwnModel* own);

}  // namespace mbv::simulation
