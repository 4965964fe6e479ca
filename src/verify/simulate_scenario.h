// One run of the simulation with a scenario's settings.
#pragma once

#include <functional>

#include "base/diagnostics.h"
#include "scenario/scenario.h"
#include "simulation/engine/simulation.h"

namespace mbv {

/// The engine's options as the scenario has them; forces are left to the caller.
[[nodiscard]] SimulationOptions OptionsOf(const Scenario& scenario, const Mechanism& mechanism,
                                          Engine engine);

struct SimulatedWitness {
  SimulationRun run;        ///< trace extrapolated; poses and MJCF of the first run
  Diagnostics diagnostics;  ///< bad input found on the way
};
/// Simulates, extrapolating if the scenario asks for it. Drives by forces or servos need options.
[[nodiscard]] SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                                             const DrivenMotion& driven,
                                             const SimulationOptions& options,
                                             const std::function<void(double)>& progress = {});
/// With the options that the scenario has for the engine.
[[nodiscard]] SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                                             const DrivenMotion& driven, Engine engine,
                                             const std::function<void(double)>& progress = {});

/// a + (b − a)(target − at_a)/(at_b − at_a) for forces and powers; motion from `a`; the worse
/// closure of both.
[[nodiscard]] Trace Extrapolate(const Trace& a, double at_a, const Trace& b, double at_b,
                                double target);

}  // namespace mbv
