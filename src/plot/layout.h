// Where the parts of a figure lie on paper: nothing overlaps, whatever the texts are.
//
//   legend of panel 1      in columns above its axes, so that it hides no curve
//   ticks | axes | colour bar of a map
//   (texts of the x axis, unless it is common to all panels)
//   … panel n, with the x axis' texts
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "plot/draw.h"
#include "plot/figure.h"
#include "plot/style.h"
#include "plot/svg_plot.h"

// The small markup of figures' texts for each way to write them.

namespace mbv {

/// For Pango in a font of this size [pt]: <i>F</i>, smaller and raised spans; escaped.
[[nodiscard]] std::string ToPango(std::string_view markup, double font_pt);
/// For TeX: \textit{F}, \textsubscript{max}, with its special characters escaped.
[[nodiscard]] std::string ToTex(std::string_view markup);
/// A text that is shown as it is: its '*', "_{" and "^{" are no markup.
[[nodiscard]] std::string AsPlainText(std::string_view text);

struct FigureTick {
  double value = 0;
  std::string text;  ///< markup
};

/// Of one panel [pt], from the figure's upper left corner.
struct PanelPlace {
  double left = 0, top = 0, width = 0, height = 0;  ///< of the axes' box
  PlotAxis x, y;                                    ///< with their places
  PlotAxis value;                                   ///< of a map's colours
  std::vector<FigureTick> x_ticks, y_ticks, value_ticks;
  bool names_x = true;    ///< has texts below
  double legend_top = 0;  ///< of its first row
  size_t legend_columns = 1;
};

struct FigureLayout {
  double width = 0, height = 0;  ///< of the whole figure [pt]
  double row = 0;                ///< from one row of text to the next [pt]
  double tick_room = 0;          ///< of the y axis' tick texts [pt]
  double bar_left = 0, bar_width = 0;
  double bar_text_room = 0;  ///< of the tick texts of a map's colours [pt]
  std::vector<PanelPlace> panels;
};

[[nodiscard]] FigureLayout LayOut(const Figure& figure, const FigureStyle& style);

/// Millimetres as points.
[[nodiscard]] constexpr double PointsOf(double mm) { return mm * 72.0 / 25.4; }
/// What a legend's sample of a line takes [pt], and the gap behind it.
inline constexpr double kSampleWidth = 17.0, kSampleGap = 3.0;
inline constexpr double kTickLength = 2.5;  ///< [pt], inwards
inline constexpr double kTextGap = 3.0;     ///< between axes and texts [pt]
/// The rows of a panel's legend.
[[nodiscard]] std::vector<const FigureCurve*> LegendOf(const FigurePanel& panel);

/// A row of a legend: its sample begins at x, and y is the middle of its line [pt].
struct LegendPlace {
  const FigureCurve* curve = nullptr;
  double x = 0, y = 0;
};
[[nodiscard]] std::vector<LegendPlace> LegendPlaces(const FigureLayout& layout,
                                                    const FigurePanel& panel,
                                                    const PanelPlace& place);

}  // namespace mbv
