#include "pipeline/engine_errors.h"

#include <algorithm>

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

double ValueOf(const std::map<Metric, Measured>& metrics, Metric metric) {
  const auto found = metrics.find(metric);
  return found == metrics.end() ? kNan : found->second.value;
}

}  // namespace

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
    const PairComparison pair = ComparePair(input, run.trace, truth);
    error.force_nrmse = ValueOf(pair.metrics, Metric::kForceNrmse);
    error.force_max_rel = ValueOf(pair.metrics, Metric::kForceMax);
    error.closure_max_m = ValueOf(MeasureWitness(input, run.trace).metrics, Metric::kClosureM);
    error.force_nrmse_later =
        ValueOf(ComparePair(later, run.trace, truth).metrics, Metric::kForceNrmse);
  }
  return comparison;
}

}  // namespace mbv
