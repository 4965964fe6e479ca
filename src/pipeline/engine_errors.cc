#include "pipeline/engine_errors.h"

#include <algorithm>

#include "comparison/metric_value.h"

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

}  // namespace

EngineError EngineErrorOf(const ComparisonInput& input, const Trace& trace, const Trace& truth) {
  const PairComparison pair = ComparePair(input, trace, truth);
  EngineError error{.engine = {}};
  error.force_nrmse = ValueOf(pair.metrics, Metric::kForceNrmse);
  error.force_max_rel = ValueOf(pair.metrics, Metric::kForceMax);
  error.closure_max_m = ValueOf(MeasureWitness(input, trace).metrics, Metric::kClosureM);
  return error;
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
