// How fast an output moves, from MuJoCo's own body velocities and accelerations.
//
// Neither the drives' rates nor the commanded ones enter: what comes out judges both.
#pragma once

#include "core/types.h"
#include "simulation/engine_model.h"

namespace mbv::simulation {

/// Time derivatives of an output's components x, y, z [m], roll, pitch, yaw [rad] in its reference
/// frame. NaN in roll and yaw where the pitch is ±90°.
struct OutputRates {
  Vec6 velocity = Vec6::Constant(kNan);
  Vec6 acceleration = Vec6::Constant(kNan);
};

/// False if one of the output's two bodies was merged into another one.
[[nodiscard]] bool HasOutputRates(const EngineModel& engine, const Output& output);

/// Expects positions, mj_comVel and mj_rnePostConstraint (cacc) of one instant in `d`.
[[nodiscard]] OutputRates OutputRatesOf(const EngineModel& engine, const mjData& d,
                                        const Output& output);

}  // namespace mbv::simulation
