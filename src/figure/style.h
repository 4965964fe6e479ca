// How figures look: a journal's column width, fonts, lines.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "report/plot_axis.h"

namespace mbv {

struct FigureStyle {
  std::string name = "ieee";
  std::string font;        ///< families in the order of preference, with commas between
  double font_pt = 8.0;    ///< of all texts [pt], > 0
  double width_mm = 88.9;  ///< of a column
  double line_pt = 0.8;    ///< of curves [pt], > 0
  double axis_pt = 0.5;    ///< of axes and ticks [pt], > 0
  double marker_pt = 3.2;  ///< of markers, across [pt], > 0
  double dpi = 300;        ///< of PNG files, > 0
  std::vector<std::string> colors = {kLineColors.begin(), kLineColors.end()};  ///< "#rrggbb"
  /// Lengths of strokes and gaps in line widths, for each colour; an empty one is solid. No two of
  /// the first eight are alike, so that curves are told apart in grey.
  std::vector<std::vector<double>> dashes = {
      {},     {6, 2},       {1.5, 1.5}, {7, 2, 1.5, 2}, {12, 2.5}, {7, 2, 1.5, 2, 1.5, 2},
      {3, 2}, {12, 2, 3, 2}};
};

/// "ieee" (3.5 in, a serif face), "springer" (84 mm, sans serif), "plain".
[[nodiscard]] const std::vector<FigureStyle>& FigureStyles();
/// The one of this name; null if there is none.
[[nodiscard]] const FigureStyle* FindFigureStyle(const std::string& name);

/// Colour and dashes of a curve; black and solid where `look` < 0.
[[nodiscard]] const std::string& ColorOf(const FigureStyle& style, int look);
[[nodiscard]] const std::vector<double>& DashesOf(const FigureStyle& style, int look);
/// The three numbers of "#rrggbb", 0 … 1.
[[nodiscard]] std::array<double, 3> RgbOf(const std::string& color);

}  // namespace mbv
