// Plots that other parts of the program describe (core/plot.h) as figures: maps, sections.
#pragma once

#include <string>

#include "core/plot.h"
#include "figure/figure.h"
#include "figure/words.h"

namespace mbv {

[[nodiscard]] Figure FromPlot(const std::string& name, const LinePlot& plot);
/// Both axes have one scale where they have one unit.
[[nodiscard]] Figure FromPlot(const std::string& name, const MapPlot& plot);

/// Sections of workspaces (analytic/workspace_form.h): what they say in words, in a language.
[[nodiscard]] Figure FromSection(const std::string& name, const LinePlot& plot, Language language);

/// "x [mm]" → "*x* (mm)", "k_min [N/m]" → "*k*_{min} (N/m)"; words as they are.
[[nodiscard]] std::string FigureLabel(const std::string& label);

}  // namespace mbv
