// Small self-contained SVG figures for documents.
#pragma once

#include <array>
#include <limits>
#include <string>
#include <vector>

#include "math/plot.h"

// Axes and colours that every plot shares, whatever draws it.

namespace mbv {

/// Colour-blind safe line colours (Okabe and Ito), "#rrggbb".
inline constexpr std::array<const char*, 8> kLineColors = {
    "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#888888"};

/// Red, green, blue: 0 … 255.
using Rgb = std::array<int, 3>;
/// Dark blue over green to yellow (a short version of viridis) for 0 … 1: ever brighter.
[[nodiscard]] Rgb MapColor(double t);

struct PlotAxis;
/// The colour of a map's cell, `value` being the range of its colours; {-1, -1, -1} where nothing
/// is shown.
[[nodiscard]] Rgb CellColor(const PlotAxis& value, double v);

/// The range of an axis, and where it lies on paper or screen.
struct PlotAxis {
  /// Logarithms to base 10 of what is shown, on a logarithmic axis.
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  bool log = false;
  double from_px = 0, to_px = 1;

  /// False of what is not finite, and on a logarithmic axis of what is not positive.
  [[nodiscard]] bool Shows(double v) const;
  [[nodiscard]] double Inner(double v) const;
  /// Widens the range to a value that can be shown.
  void Add(double v);
  /// Leaves room at both ends; an empty range becomes 0 … 1.
  void Pad();
  [[nodiscard]] double Px(double v) const;
  /// Round values inside the range: decades (with their doubles and fivefolds where they are few),
  /// or steps of 1, 2 or 5 times a power of ten, about `wanted` of them.
  [[nodiscard]] std::vector<double> Ticks(int wanted = 6) const;

 private:
  [[nodiscard]] std::vector<double> Decades(int wanted) const;
};

/// Widens the axis whose unit would be longer, so that both have one scale.
void EqualScale(PlotAxis* x, PlotAxis* y);

/// One name with a bar per column.
struct BarRow {
  std::string name;
  std::vector<double> shares;  ///< in parts of one; shown in percent
  /// Per share: the interval that it lies in, drawn as a line with ends; empty: none is known.
  std::vector<std::array<double, 2>> intervals = {};
};
struct BarPlot {
  std::string title;                      ///< for readers who do not see the bars
  std::vector<std::string> columns = {};  ///< what the bars of each column show
  std::vector<BarRow> rows = {};
  size_t shown = 24;  ///< rows that are drawn, to the scale of all
};

/// A name of at most `most` letters: the end says more than the beginning.
[[nodiscard]] std::string ShortenedName(const std::string& name, size_t most);

[[nodiscard]] std::string ToSvg(const LinePlot& plot);
/// Drawn from dark (low) to bright (high).
[[nodiscard]] std::string ToSvg(const MapPlot& plot);
/// In the colour of the text around it.
[[nodiscard]] std::string ToSvg(const BarPlot& plot);

// Contour lines of values on a regular grid of points.

/// A piece of a contour in grid units: (0, 0) is the first point, x counts columns, y rows.
struct ContourPiece {
  std::array<double, 2> from{}, to{};
};

/// Pieces where the linearly interpolated value is `level` (marching squares; a saddle is resolved
/// by its mean). Squares with a missing corner (NaN) have none. `values` is rows × columns.
[[nodiscard]] std::vector<ContourPiece> Contour(const std::vector<double>& values, int columns,
                                                int rows, double level);

}  // namespace mbv
