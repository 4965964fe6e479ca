// Small self-contained SVG figures for documents.
#pragma once

#include <string>
#include <vector>

#include "core/plot.h"

namespace mbv {

/// One name with a bar per column.
struct BarRow {
  std::string name;
  std::vector<double> shares;  ///< in parts of one; shown in percent
};
struct BarPlot {
  std::string title;                 ///< for readers who do not see the bars
  std::vector<std::string> columns;  ///< what the bars of each column show
  std::vector<BarRow> rows;
  size_t shown = 24;  ///< rows that are drawn, to the scale of all
};

[[nodiscard]] std::string ToSvg(const LinePlot& plot);
/// Drawn from dark (low) to bright (high).
[[nodiscard]] std::string ToSvg(const MapPlot& plot);
/// In the colour of the text around it.
[[nodiscard]] std::string ToSvg(const BarPlot& plot);

}  // namespace mbv
