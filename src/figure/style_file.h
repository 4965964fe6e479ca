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
#pragma once

#include <optional>
#include <string>

#include "core/diagnostics.h"
#include "figure/style.h"

namespace mbv {

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

}  // namespace mbv
