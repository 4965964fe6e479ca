// The simulator's own modelling error: one scenario by several engines.
#pragma once

#include <vector>

#include "report/report.h"
#include "simulation/simulation.h"

namespace mbv {

struct EngineRun {
  Engine engine = Engine::kCorrected;
  Trace trace;
  RunSummary summary;
};

/// Of one trace; what is measured later and the engine's name are left to the caller.
[[nodiscard]] EngineError EngineErrorOf(const ComparisonInput& input, const Trace& trace,
                                        const Trace& truth);

/// Errors of the runs' drive forces against `truth`, over all samples that `input` judges and
/// without the first EngineComparison::later_s.
[[nodiscard]] EngineComparison CompareEngines(const ComparisonInput& input, const Trace& truth,
                                              const std::vector<EngineRun>& runs);

}  // namespace mbv
