// Plots of a run for viewers without JavaScript.
#pragma once

#include <string>

#include "report/report.h"

namespace mbv {

/// Drive forces of the main pair's measured witness over time, one plot per unit, and the errors
/// against the other witness on a logarithmic scale, as inline SVG; "" if no forces were compared.
[[nodiscard]] std::string StaticPlotsHtml(const Report& report);

}  // namespace mbv
