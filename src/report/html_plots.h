// Plots of a run for viewers without JavaScript.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "report/report.h"

namespace mbv {

using PlotPoints = std::vector<std::pair<double, double>>;  ///< time [s], value

/// More points than a plot can show are thinned; the extremes of each bin are kept.
[[nodiscard]] PlotPoints Thinned(const PlotPoints& points);

/// Drive forces of the main pair's measured witness over time, one plot per unit, and the errors
/// against the other witness on a logarithmic scale, as inline SVG; "" if no forces were compared.
[[nodiscard]] std::string StaticPlotsHtml(const Report& report);

}  // namespace mbv
