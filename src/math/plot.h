// Figures as data: line plots and coloured maps. Drawn by plot/svg_plot.h.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace mbv {

struct PlotLine {
  std::string label;                                   ///< empty: not in the legend
  std::vector<std::pair<double, double>> points = {};  ///< NaN breaks the line
  bool markers = false;                                ///< dots at the points
  bool closed = false;
  bool dashed = false;
};

/// Filled between two curves, behind all lines.
struct PlotArea {
  std::string label;  ///< empty: not in the legend
  std::vector<double> x, lower, upper;
};

struct LinePlot {
  std::string title, x_label, y_label;  ///< labels carry the unit
  bool log_x = false, log_y = false;    ///< logarithmic axes; points that are not > 0 are left out
  bool equal_scale = false;             ///< one unit is as long on x as on y (sections, paths)
  std::vector<PlotLine> lines = {};
  std::vector<PlotArea> areas = {};
};

/// Values on a regular grid of cells.
struct MapPlot {
  std::string title, x_label, y_label, value_label;
  double x_min = 0, x_max = 1, y_min = 0, y_max = 1;  ///< outer edges of the grid
  int columns = 0, rows = 0;                          ///< row 0 at y_min
  std::vector<double> values = {};                    ///< rows × columns; NaN is left blank
  bool log_scale = false;
  int contours = 0;  ///< number of contour lines, in equal steps of the colour scale
};

}  // namespace mbv
