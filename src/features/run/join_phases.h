// The phases of a scenario, each run and judged as a mechanism of its own, as one result over time.
#pragma once

#include <optional>
#include <vector>

#include "mechanism/mechanism.h"
#include "report/report.h"
#include "scenario/scenario.h"
#include "simulation/engine/simulation.h"

namespace mbv {

/// What the run of a phase gave.
struct PhaseRun {
  ScenarioPhase phase;
  Report report;                            ///< its times are the scenario's
  std::optional<SimulationRun> simulation;  ///< the same
};

/// One report of all phases in order (at least one; fewer than the scenario has where the motion of
/// the last one is not possible). A value of a check is the worst of the phases, and its place and
/// time are that one's. Signals of feet that do not stand are NaN. Motors' loads are those of the
/// whole motion, without the inertia that a drive moves, which changes with the feet.
[[nodiscard]] Report JoinPhases(const Mechanism& mechanism, std::vector<PhaseRun>* runs);

/// Their poses and traces after each other; the model's text is the first one's.
[[nodiscard]] std::optional<SimulationRun> JoinSimulations(std::vector<PhaseRun>* runs);

}  // namespace mbv
