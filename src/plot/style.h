// How figures look: a journal's column width, fonts, lines.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "plot/svg_plot.h"

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
  /// the first eight are alike, so that curves differ in grey.
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

// Styles of figures from files.
//
//   based_on: ieee            # the rest of the values: ieee, springer, plain
//   font: "Charis SIL, serif"
//   font_pt: 9
//   width_mm: 150
//   line_pt: 0.8
//   axis_pt: 0.5
//   marker_pt: 3.2
//   dpi: 600
//   colors: ["#0072b2", "#d55e00"]
//   dashes: [[], [6, 2]]      # strokes and gaps in line widths

/// Numbers that a style may have.
struct StyleRange {
  const char* key;
  double FigureStyle::*value;
  double least, most;
};
[[nodiscard]] const std::vector<StyleRange>& StyleRanges();

/// Empty after findings that are errors. Colours of the same dashes are a warning.
[[nodiscard]] std::optional<FigureStyle> LoadFigureStyle(const std::string& file,
                                                         Diagnostics* diagnostics);

// Units in which figures show what channels record in SI.

struct ShownUnit {
  std::string si;       ///< as channels name it: "N m"
  std::string name;     ///< as files name it: "kN m"
  std::string shown;    ///< in a label: "kN·m"
  double factor = 1.0;  ///< shown = factor · SI
};

/// The unit `name` of what is recorded in `si`; null if no unit has this name.
[[nodiscard]] const ShownUnit* FindUnit(const std::string& si, const std::string& name);
/// The names of all units of what is recorded in `si`; at least itself.
[[nodiscard]] std::vector<std::string> UnitsOf(const std::string& si);
/// The one in which values up to `largest` (SI) are short; degrees for angles.
[[nodiscard]] ShownUnit UsualUnit(const std::string& si, double largest);

}  // namespace mbv
