// Runs the three witnesses of a scenario.
#pragma once

#include <string>

#include "analytic/closed_form.h"
#include "core/diagnostics.h"
#include "core/run_summary.h"
#include "mechanism/mechanism.h"
#include "pipeline/run_scenario.h"
#include "scenario/scenario.h"
#include "simulation/simulation.h"

namespace mbv {

/// The scenario's mechanism as each witness sees it (their own parameter overrides applied).
struct WitnessMechanisms {
  Mechanism analytic, reference, simulated;
};

/// Loads the variants; findings are bad input.
[[nodiscard]] WitnessMechanisms LoadWitnessMechanisms(const Scenario& scenario,
                                                      const Mechanism& base,
                                                      Diagnostics* diagnostics);

/// A closed form for a scenario, or the reason why there is none.
struct ClosedFormChoice {
  std::unique_ptr<ClosedForm> closed_form;
  std::string reason;  ///< not empty: switched off, or the mechanism has none, or it is outside
                       ///< what the equations cover
};
/// Unsuitable models, errata and commands are errors; what the equations do not cover of the
/// mechanism and its loads is a warning each.
[[nodiscard]] ClosedFormChoice MakeClosedForm(const Scenario& scenario, const Mechanism& mechanism,
                                              Diagnostics* diagnostics);

/// Drive motion for the simulation, computed by the closed form or by the reference.
[[nodiscard]] DrivenMotion DriveByClosedForm(const Motion& motion,
                                             std::shared_ptr<ClosedForm> closed_form);
/// Of a free motion: commanded drives and prescribed joints; the other entries are 0.
[[nodiscard]] DrivenMotion DriveByCommands(const Mechanism& mechanism, const Motion& motion);
[[nodiscard]] DrivenMotion DriveByReference(const Mechanism& mechanism, const Motion& motion);

/// Drive forces for the commanded motion, computed by the closed form or by the reference.
[[nodiscard]] DriveForces ForcesByClosedForm(const Motion& motion,
                                             std::shared_ptr<ClosedForm> closed_form);
[[nodiscard]] DriveForces ForcesByReference(const Mechanism& mechanism, const Motion& motion);

/// The engine's options as the scenario has them; forces are left to the caller.
[[nodiscard]] SimulationOptions OptionsOf(const Scenario& scenario, const Mechanism& mechanism,
                                          Engine engine);

/// Simulates, extrapolating if the scenario asks for it. Drives by forces or servos need options.
struct SimulatedWitness {
  SimulationRun run;        ///< trace extrapolated; poses and MJCF of the first run
  Diagnostics diagnostics;  ///< bad input found on the way
};
[[nodiscard]] SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                                             const DrivenMotion& driven, Engine engine,
                                             const std::function<void(double)>& progress);
/// The same with the engine's options given instead of taken from the scenario.
[[nodiscard]] SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                                             const DrivenMotion& driven,
                                             const SimulationOptions& options,
                                             const std::function<void(double)>& progress);

/// a + (b − a)(target − at_a)/(at_b − at_a) for forces and powers; motion from `a`; the worse
/// closure of both.
[[nodiscard]] Trace Extrapolate(const Trace& a, double at_a, const Trace& b, double at_b,
                                double target);

}  // namespace mbv
