// Plots that other parts of the program describe (math/plot.h) as figures: maps, sections.
#pragma once

#include <string>

#include "features/convergence/order.h"
#include "features/paper/default_figures.h"
#include "features/paper/signals.h"
#include "math/plot.h"
#include "plot/figure.h"

namespace mbv {

[[nodiscard]] Figure FromPlot(const std::string& name, const LinePlot& plot);
/// Both axes have one scale where they have one unit.
[[nodiscard]] Figure FromPlot(const std::string& name, const MapPlot& plot);

/// Sections of workspaces (analytic/workspace_form.h): what they say in words, in a language.
[[nodiscard]] Figure FromSection(const std::string& name, const LinePlot& plot, Language language);

/// "x [mm]" → "*x* (mm)", "k_min [N/m]" → "*k*_{min} (N/m)"; words as they are.
[[nodiscard]] std::string FigureLabel(const std::string& label);

// Errors of drive forces against what a simulation is refined by, in logarithmic axes, with lines
// of the slopes that were fitted; the legend names them beside those that the schemes promise.

/// "convergence_step" (step, with the time constant or alone) and "convergence_time_constant";
/// series without two errors above zero are left out, with the reason.
[[nodiscard]] FigureSet ConvergenceFigures(const ConvergenceReport& report, Language language);

}  // namespace mbv
