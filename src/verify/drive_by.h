// Simulations whose drives are force-controlled (open loop) or servos.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "analytic/closed_form.h"
#include "math/trace.h"
#include "mechanism/motion.h"
#include "reference/forward.h"
#include "reference/reference.h"
#include "scenario/scenario.h"
#include "simulation/engine/simulation.h"
#include "verify/prepare.h"

namespace mbv {

/// The reference on the motion that a simulation reached: every drive commanded where `simulated`
/// has it, prescribed joints by their commands. The trace of kReached.
[[nodiscard]] ReferenceRun RunReached(const Mechanism& mechanism, const Motion& motion,
                                      const Trace& simulated);

/// `forces`, wrong by `perturbation` of the RMS drive force in `truth` (per unit), with alternating
/// signs from drive to drive.
[[nodiscard]] DriveForces PerturbedForces(const DriveForces& forces, const Mechanism& mechanism,
                                          const Trace& truth, double perturbation);

/// Gains of all drives.
[[nodiscard]] ServoGains GainsOf(const ServoSettings& settings, const Mechanism& mechanism);

/// "forward", "inverse", "force_driven", "servo" or "off".
[[nodiscard]] const char* ModeText(const SimulationSettings& settings);

/// What the simulation does, in one line: mode, step, engine, what moves it, samples.
[[nodiscard]] std::string SimulationLine(const Prepared& prepared);

/// "driven in open loop by the analytic drive forces", "servos with kp 2e+05, kv 600, …".
[[nodiscard]] std::string DriveText(const SimulationSettings& settings,
                                    const std::string& driven_by);

// Motion and forces of the drives for a simulation, computed at any time by another witness.

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

// What a report says about a free motion.

/// "free motion of 2 DOFs from crank = 0.8, rocker at rest at home".
[[nodiscard]] std::string FreeMotionText(const Mechanism& mechanism, const Motion& motion);

/// How far the reference's trajectory can be trusted: its own error, and the growth of differences.
[[nodiscard]] std::string TrustLine(const ForwardRun& run);

/// One sentence for each singular pose passed, at most five.
[[nodiscard]] std::vector<std::string> CrossingTexts(const ForwardRun& run, double duration_s);

}  // namespace mbv
