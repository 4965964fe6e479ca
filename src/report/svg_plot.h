// Small self-contained SVG figures for documents.
#pragma once

#include <string>

#include "core/plot.h"

namespace mbv {

[[nodiscard]] std::string ToSvg(const LinePlot& plot);
/// Drawn from dark (low) to bright (high).
[[nodiscard]] std::string ToSvg(const MapPlot& plot);

}  // namespace mbv
