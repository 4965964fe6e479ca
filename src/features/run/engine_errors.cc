#include "features/run/engine_errors.h"

#include <algorithm>
#include <cmath>

#include "comparison/verdict.h"
#include "verify/run_witnesses.h"

namespace mbv {
namespace {

const char* KeyOf(Engine engine) {
  switch (engine) {
    case Engine::kDefaults:
      return "defaults";
    case Engine::kStock:
      return "stock";
    case Engine::kCorrected:
      return "corrected";
  }
  return "";
}

constexpr int kMostHalvings = 3;
constexpr double kMostSteps = 4e5;

// Without breakaway and Stribeck's curve; `left_out`: whether there were some.
Mechanism WithCoulombAlone(Mechanism mechanism, bool* left_out) {
  for (ForceElement& element : mechanism.elements) {
    auto* law = std::get_if<FrictionLaw>(&element.law);
    if (law == nullptr || law->breakaway == law->coulomb) continue;
    law->breakaway = law->coulomb;
    law->stribeck_rate = 0.0;
    *left_out = true;
  }
  return mechanism;
}

}  // namespace

EngineError EngineErrorOf(const ComparisonInput& input, const Trace& trace, const Trace& truth) {
  const PairComparison pair = ComparePair(input, trace, truth);
  EngineError error{.engine = {}};
  error.force_nrmse = ValueOf(pair.metrics, Metric::kForceNrmse);
  error.force_max_rel = ValueOf(pair.metrics, Metric::kForceMax);
  error.closure_max_m = ValueOf(MeasureWitness(input, trace).metrics, Metric::kClosureM);
  return error;
}

FrictionError FrictionErrorOf(const ComparisonInput& input, const Trace& trace,
                              const Trace& truth) {
  const PairComparison pair = ComparePair(input, trace, truth);
  FrictionError error{.check = {}};
  for (const Metric metric :
       {Metric::kPositionM, Metric::kPositionRad, Metric::kPoseM, Metric::kPoseRad}) {
    const double value = ValueOf(pair.metrics, metric);
    const std::optional<double> limit = input.limits[metric].Of(input.simulation_limits);
    if (std::isnan(value) || !limit) continue;
    if (!error.check.empty() && value * error.limit <= error.value * *limit) continue;
    error.check = RowOf(metric).title;
    error.unit = RowOf(metric).unit;
    error.value = value;
    error.limit = *limit;
  }
  if (error.check.empty()) error.failure = "no position has a limit";
  return error;
}

EngineComparison CompareStockFriction(const Prepared& prepared, const Trace& truth,
                                      const std::function<void(double)>& progress, double* wall_s) {
  const Scenario& scenario = prepared.scenario;
  EngineComparison comparison{.truth = truth.witness, .engines = {}};
  const Mechanism stock =
      WithCoulombAlone(prepared.mechanisms.simulated, &comparison.coulomb_alone);
  const ComparisonInput input = InputOf(prepared);
  SimulationOptions options = OptionsOf(scenario, stock, Engine::kStock);
  double steps = 0.0;
  for (int halving = 0; halving <= kMostHalvings; ++halving, options.step_s *= 0.5) {
    steps += scenario.motion.duration_s / options.step_s;
    if (halving > 0 && steps > kMostSteps) break;
    const SimulatedWitness witness =
        RunSimulation(scenario, stock, prepared.MakeDrivenMotion(), options, progress);
    *wall_s += witness.run.summary.wall_s;
    FrictionError error{.check = {}};
    if (witness.run.summary.ok()) {
      error = FrictionErrorOf(input, witness.run.trace, truth);
    } else {
      error.failure = witness.run.summary.message;
    }
    error.step_s = options.step_s;
    comparison.friction.push_back(error);
    if (error.within() || !error.failure.empty()) break;
  }
  return comparison;
}

EngineComparison CompareEngines(const ComparisonInput& input, const Trace& truth,
                                const std::vector<EngineRun>& runs) {
  EngineComparison comparison{.truth = truth.witness, .engines = {}};
  ComparisonInput later = input;
  later.start_window_s = std::max(later.start_window_s, comparison.later_s);
  for (const EngineRun& run : runs) {
    EngineError& error = comparison.engines.emplace_back(EngineError{.engine = KeyOf(run.engine)});
    if (!run.summary.ok()) {
      error.failure = run.summary.message;
      continue;
    }
    error = EngineErrorOf(input, run.trace, truth);
    error.engine = KeyOf(run.engine);
    error.force_nrmse_later = EngineErrorOf(later, run.trace, truth).force_nrmse;
  }
  return comparison;
}

}  // namespace mbv
