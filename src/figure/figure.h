// A figure for a paper as data: panels one below the other, their axes, curves and legends. Drawn
// by figure/draw.h (PDF, SVG, PNG), written as source for TeX by figure/pgf.h.
//
// Texts know a little markup: *F* is a symbol (italic), _{max} and ^{2} stand below and above.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/plot.h"
#include "core/types.h"

namespace mbv {

/// Points of a curve in the axes' units; NaN breaks it.
using FigurePoints = std::vector<std::pair<double, double>>;

struct FigureCurve {
  std::string label = {};    ///< markup; "": not in the legend
  FigurePoints points = {};  ///< empty: a row of the legend only
  int look = 0;              ///< which colour and dashes of the style; < 0: black, solid
  bool line = true;
  bool extent = false;  ///< strokes between ends: thin, and solid whatever the look is
  int marker = -1;      ///< which shape of kMarkerShapes stands at the points; -1: none
};

/// Shapes of markers that are told apart without colour.
enum class Marker { kCircle, kSquare, kTriangle, kDiamond, kCross, kPlus };
inline constexpr int kMarkerShapes = 6;

struct FigureAxis {
  std::string label = {};  ///< markup, with the unit: "Drive force *F* (N)"
  bool log = false;        ///< values that are not > 0 are left out
};

struct FigurePanel {
  FigureAxis x = {}, y = {};
  std::vector<FigureCurve> curves = {};
  /// Coloured cells below the curves; its labels are the axes' and that of the colours.
  std::optional<MapPlot> map = {};
  bool equal_scale = false;  ///< one unit is as long on x as on y
  double share = 1.0;        ///< of its height against that of the other panels
};

struct Figure {
  std::string name;          ///< of its files
  std::string caption = {};  ///< for the paper's text; not drawn
  std::vector<FigurePanel> panels = {};
  bool common_x = false;    ///< only the last panel names the x axis
  double width_mm = kNan;   ///< NaN: the style's
  double height_mm = kNan;  ///< NaN: what the panels' usual heights give
};

}  // namespace mbv
