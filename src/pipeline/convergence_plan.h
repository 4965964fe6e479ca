// Which runs show how the simulated forces converge: over the step, the time constant, and both; of
// the corrected engine and of the stock one.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "comparison/convergence.h"
#include "core/types.h"

namespace mbv {

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

}  // namespace mbv
