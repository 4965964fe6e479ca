// Convergence study: does the forward simulation tend to the forces of inverse mode, with the order
// that its scheme has?
//
// Two numbers of the simulation are artificial: the step and the time constant with which
// constraints are guided. They are refined together, as runs do it, and each alone, for the
// corrected engine and for stock MuJoCo (docs/explanation/convergence.md).
#pragma once

#include <string>
#include <vector>

#include "comparison/convergence.h"
#include "core/diagnostics.h"
#include "pipeline/progress.h"
#include "scenario/load_scenario.h"

namespace mbv {

struct ConvergeOptions {
  /// At least three steps [s], each a whole fraction of the one before, all by the same factor.
  std::vector<double> steps_s = {4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4};
  ScenarioOptions scenario = {};
  int jobs = 1;                    ///< processes at once; the results do not depend on it
  ProgressFunction progress = {};  ///< of all runs, by their numbers of steps
};
[[nodiscard]] Diagnostics Check(const ConvergeOptions& options);

struct ConvergeOutcome {
  int exit_code = 4;  ///< 0 orders as expected, 1 a finding, 2 bad input, 3 could not run
  Diagnostics diagnostics;
  std::string failure;       ///< why nothing could be judged; "" otherwise
  ConvergenceReport report;  ///< with exit codes 0 and 1
};

/// Samples lie on a grid of whole coarsest steps, at least as far apart as the scenario's own.
[[nodiscard]] ConvergeOutcome Converge(const std::string& file, const ConvergeOptions& options);

}  // namespace mbv
