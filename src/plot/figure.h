// A figure for a paper as data: panels one below the other, their axes, curves and legends. Drawn
// by plot/draw.h (PDF, SVG, PNG), written as source for TeX by plot/draw.h.
//
// Texts know a little markup: *F* is a symbol (italic), _{max} and ^{2} stand below and above.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"
#include "math/plot.h"
#include "math/trace.h"

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

/// Shapes of markers that differ without colour.
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

// `figures:` of a scenario: figures that its author composes, as data.

/// A word of a file, with its place and the key that it stands under, for findings.
struct PlacedText {
  std::string text = {};
  std::string path = {};  ///< "figures[0].panels[1].unit"
  int line = 0, column = 0;

  [[nodiscard]] bool given() const { return !text.empty(); }
};

/// Signals over time, or over another signal.
struct PanelSpec {
  std::vector<PlacedText> signals = {};    ///< channels; '*' stands for any characters
  std::vector<PlacedText> witnesses = {};  ///< roles' names; empty: all that ran
  std::vector<PlacedText> marks = {};      ///< of the witnesses: those without lines
  PlacedText against = {};  ///< |signal − the same of this witness|; not given: the signal itself
  PlacedText x = {};        ///< a channel; not given: time
  PlacedText unit = {}, x_unit = {};              ///< not given: the usual one
  std::string label = {}, x_label = {};           ///< markup of figures; "": the names
  std::map<std::string, std::string> names = {};  ///< legend (markup), by channel
  bool log = false, legend = true;
  bool from_start = false;   ///< changes since the first sample
  bool equal_scale = false;  ///< one unit is as long on x as on y
  double share = 1.0;        ///< of the height, against the other panels
};

struct FigureSpec {
  PlacedText name;
  std::string caption = {};
  double width_mm = kNan, height_mm = kNan;  ///< NaN: the style's
  std::vector<PanelSpec> panels = {};
};

// Whether the figures that a scenario composes can be drawn.

/// Whether a channel's name fits a pattern, in which '*' stands for any characters.
[[nodiscard]] bool FitsPattern(const std::string& name, const std::string& pattern);

/// Signals, witnesses and units that do not exist or do not go together are errors at their places
/// in `file`. `known`: all channels that some witness may record; `foreign`: names of the
/// scenario's foreign witnesses.
void CheckFigures(const std::vector<FigureSpec>& figures, const std::vector<Channel>& known,
                  const std::vector<std::string>& foreign, const std::string& file,
                  Diagnostics* diagnostics);

}  // namespace mbv
