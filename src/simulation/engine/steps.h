// The time steps of a forward run: a uniform grid that carries the samples, and the times at which
// a commanded profile changes its formula.
#pragma once

#include <vector>

#include "mechanism/motion.h"

namespace mbv::simulation {

struct Step {
  double from_s = 0.0, to_s = 0.0;
  int uniform = 0;   ///< smooth uniform nodes before `to_s`, `from_s` included (at most 4): what a
                     ///< multistep formula may use. 0 when the step itself is shorter.
  long sample = -1;  ///< index of the sample at `to_s`, or -1
};

/// Steps of length `step_s`, adjusted so that samples fall on whole steps; a step is divided where
/// some profile of the motion has a break.
[[nodiscard]] std::vector<Step> MakeSteps(const Motion& motion, double step_s);

/// The adjusted step [s].
[[nodiscard]] double AdjustedStep(const Motion& motion, double step_s);

}  // namespace mbv::simulation
