// The simulator's own modelling error: one scenario by several engines.
#pragma once

#include <functional>
#include <vector>

#include "report/report.h"
#include "simulation/engine/simulation.h"
#include "verify/prepare.h"

namespace mbv {

struct EngineRun {
  Engine engine = Engine::kCorrected;
  Trace trace;
  RunSummary summary;
};

/// Of one trace; what is measured later and the engine's name are left to the caller.
[[nodiscard]] EngineError EngineErrorOf(const ComparisonInput& input, const Trace& trace,
                                        const Trace& truth);

/// Of one trace of a free motion: the positions and outputs that it misses farthest, as a share of
/// their limits.
[[nodiscard]] FrictionError FrictionErrorOf(const ComparisonInput& input, const Trace& trace,
                                            const Trace& truth);

/// A free motion with dry friction as MuJoCo's own frictionloss has it, with coulomb alone, which
/// is all that it knows: at the scenario's step and at halved ones until one is good enough, or
/// some hundred thousand steps are done.
[[nodiscard]] EngineComparison CompareStockFriction(const Prepared& prepared, const Trace& truth,
                                                    const std::function<void(double)>& progress,
                                                    double* wall_s);

/// Errors of the runs' drive forces against `truth`, over all samples that `input` judges and
/// without the first EngineComparison::later_s.
[[nodiscard]] EngineComparison CompareEngines(const ComparisonInput& input, const Trace& truth,
                                              const std::vector<EngineRun>& runs);

}  // namespace mbv
