// Errors of drive forces against what a simulation is refined by, in logarithmic axes, with lines
// of the slopes that were fitted; the legend names them beside those that the schemes promise.
#pragma once

#include "comparison/convergence.h"
#include "figure/default_figures.h"
#include "figure/words.h"

namespace mbv {

/// "convergence_step" (step, with the time constant or alone) and "convergence_time_constant";
/// series without two errors above zero are left out, with the reason.
[[nodiscard]] FigureSet ConvergenceFigures(const ConvergenceReport& report, Language language);

}  // namespace mbv
