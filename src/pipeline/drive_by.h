// What goes with simulations whose drives are pushed or servos.
#pragma once

#include <string>

#include "core/trace.h"
#include "pipeline/prepare.h"
#include "reference/reference.h"
#include "scenario/scenario.h"
#include "simulation/simulation.h"

namespace mbv {

/// The reference on the motion that a simulation reached: every drive commanded where `simulated`
/// has it, prescribed joints by their commands. The trace of kReached.
[[nodiscard]] ReferenceRun RunReached(const Mechanism& mechanism, const Motion& motion,
                                      const Trace& simulated);

/// `forces`, wrong by `bend` of the RMS drive force in `truth` (per unit), with alternating signs
/// from drive to drive.
[[nodiscard]] DriveForces Bent(const DriveForces& forces, const Mechanism& mechanism,
                               const Trace& truth, double bend);

/// Gains of all drives.
[[nodiscard]] ServoGains GainsOf(const ServoSettings& settings, const Mechanism& mechanism);

/// "forward", "inverse", "force_driven", "servo" or "off".
[[nodiscard]] const char* ModeText(const SimulationSettings& settings);

/// What the simulation does, in one line: mode, step, engine, what moves it, samples.
[[nodiscard]] std::string SimulationLine(const Prepared& prepared);

/// "pushed in open loop by the analytic drive forces", "servos with kp 2e+05, kv 600, …".
[[nodiscard]] std::string DriveText(const SimulationSettings& settings,
                                    const std::string& driven_by);

}  // namespace mbv
