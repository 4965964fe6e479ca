// Coordinates that loads follow, read from MuJoCo's own positions and velocities.
#pragma once

#include <vector>

#include "mechanism/motion.h"
#include "simulation/engine_model.h"

namespace mbv::simulation {

/// kUnsupported where a load follows a coordinate that MuJoCo does not have.
[[nodiscard]] RunSummary CheckLoadInputs(const EngineModel& engine, const Load& load);

/// What a load is besides its profiles, at the data's position (tendons) and velocity (mj_comVel):
/// [force; moment], in the load's axes.
[[nodiscard]] Vec6 FollowingPart(const EngineModel& engine, const mjData& d, const Load& load,
                                 double t_s);

}  // namespace mbv::simulation
