// Convergence study: does the forward simulation tend to the forces of inverse mode, with the order
// that its scheme has?
//
// Two numbers of the simulation are artificial: the step and the time constant with which
// constraints are stabilized. They are refined together, as runs do it, and each alone, for the
// corrected engine and for stock MuJoCo (docs/explanation/convergence.md).
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"
#include "features/convergence/order.h"
#include "scenario/load_scenario.h"
#include "verify/run_witnesses.h"

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

// Which runs show how the simulated forces converge: over the step, the time constant, and both; of
// the corrected engine and of the stock one.

/// What a run is: a step, a time constant, an engine.
struct PlannedRun {
  std::string title;
  bool stock = false;
  double step_s = kNan, constant_steps = kNan;  ///< time constant in steps

  [[nodiscard]] double cost() const { return 1.0 / step_s; }
};

struct PlannedSeries {
  ConvergenceSeries series;
  std::vector<std::pair<double, double>> grid;  ///< step, time constant in steps, coarse to fine
};

/// Their runs, in order.
[[nodiscard]] std::vector<PlannedRun> RunsOf(const std::vector<PlannedSeries>& all);
[[nodiscard]] double CostOf(const std::vector<PlannedSeries>& all);

class ConvergencePlan {
 public:
  /// Steps from coarse to fine; at least three.
  explicit ConvergencePlan(std::vector<double> steps_s) : steps_s_(std::move(steps_s)) {}

  /// The corrected engine's: without it the rest says nothing.
  [[nodiscard]] std::vector<PlannedSeries> UsualRefinement() const;
  [[nodiscard]] std::vector<PlannedSeries> Others() const;

 private:
  using Grid = std::vector<std::pair<double, double>>;
  [[nodiscard]] Grid Both(double constant_steps) const;
  [[nodiscard]] Grid StepAlone(double constant_steps) const;

  std::vector<double> steps_s_;
};

// Writers of a convergence study.

/// A table to read.
[[nodiscard]] std::string ToText(const ConvergenceReport& report);
/// One row per run, 17 significant digits.
[[nodiscard]] std::string ToCsv(const ConvergenceReport& report);
/// Everything.
[[nodiscard]] std::string ToJson(const ConvergenceReport& report);
/// File names and contents: error against step, time constant and processor time.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> ConvergencePlots(
    const ConvergenceReport& report);

}  // namespace mbv
