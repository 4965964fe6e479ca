#include "figure/draw.h"

#include <cmath>

#include "figure/layout.h"
#include "report/svg_contours.h"

namespace mbv {
namespace {

constexpr double kTextGap = 3.0;  // between axes and texts [pt]
constexpr const char* kBlack = "#000000";

class FigurePainter {
 public:
  FigurePainter(const Figure& figure, const FigureStyle& style, const FigureLayout& layout,
                const Canvas& canvas)
      : figure_(figure), style_(style), layout_(layout), canvas_(canvas) {}

  void Paint() const {
    for (size_t k = 0; k < figure_.panels.size(); ++k) {
      const FigurePanel& panel = figure_.panels[k];
      const PanelPlace& place = layout_.panels[k];
      canvas_.Clipped(place.left, place.top, place.width, place.height, [&] {
        if (panel.map) Map(*panel.map, place);
        for (const FigureCurve& curve : panel.curves) Curve(panel, curve, place);
      });
      // Markers lie above all lines, and may reach over the axes.
      for (const FigureCurve& curve : panel.curves) Markers(curve, place);
      Axes(panel, place);
      Legend(panel, place);
      if (panel.map) ColorBar(*panel.map, place);
    }
  }

 private:
  static FigurePoints OnPaper(const FigureCurve& curve, const PanelPlace& place) {
    FigurePoints points;
    for (const auto& [x, y] : curve.points) {
      const bool shown = place.x.Shows(x) && place.y.Shows(y);
      points.emplace_back(shown ? place.x.Px(x) : kNan, shown ? place.y.Px(y) : kNan);
    }
    return points;
  }

  void Curve(const FigurePanel& panel, const FigureCurve& curve, const PanelPlace& place) const {
    if (!curve.line || curve.points.empty()) return;
    if (curve.extent) {
      canvas_.Line(OnPaper(curve, place), ColorOf(style_, curve.look), style_.axis_pt);
      return;
    }
    // Noise on a logarithmic scale would be a black area.
    const double width = panel.y.log ? 0.75 * style_.line_pt : style_.line_pt;
    canvas_.Line(OnPaper(curve, place), ColorOf(style_, curve.look), width,
                 DashesOf(style_, curve.look));
  }

  void Markers(const FigureCurve& curve, const PanelPlace& place) const {
    if (curve.marker < 0) return;
    for (const auto& [x, y] : OnPaper(curve, place)) {
      if (!std::isfinite(x)) continue;
      canvas_.Mark(static_cast<Marker>(curve.marker % kMarkerShapes), x, y,
                   ColorOf(style_, curve.look));
    }
  }

  void XTicks(const PanelPlace& place) const {
    const double top = place.top, bottom = place.top + place.height;
    for (const FigureTick& tick : place.x_ticks) {
      const double x = place.x.Px(tick.value);
      canvas_.Line({{x, bottom}, {x, bottom - kTickLength}}, kBlack, style_.axis_pt);
      canvas_.Line({{x, top}, {x, top + kTickLength}}, kBlack, style_.axis_pt);
      if (!place.names_x) continue;
      canvas_.Text(tick.text, {.x = x, .y = bottom + kTextGap, .across = 0.5});
    }
  }

  void YTicks(const PanelPlace& place) const {
    const double left = place.left, right = place.left + place.width;
    for (const FigureTick& tick : place.y_ticks) {
      const double y = place.y.Px(tick.value);
      canvas_.Line({{left, y}, {left + kTickLength, y}}, kBlack, style_.axis_pt);
      canvas_.Line({{right, y}, {right - kTickLength, y}}, kBlack, style_.axis_pt);
      canvas_.Text(tick.text, {.x = left - kTextGap, .y = y, .across = 1, .down = 0.5});
    }
  }

  void Axes(const FigurePanel& panel, const PanelPlace& place) const {
    canvas_.Box(place.left, place.top, place.width, place.height, style_.axis_pt);
    XTicks(place);
    YTicks(place);
    const double middle = place.top + 0.5 * place.height;
    const double label_x = place.left - 2 * kTextGap - layout_.tick_room;
    canvas_.Text(panel.y.label,
                 {.x = label_x, .y = middle, .across = 0.5, .down = 1, .upwards = true});
    if (!place.names_x) return;
    canvas_.Text(panel.x.label, {.x = place.left + 0.5 * place.width,
                                 .y = place.top + place.height + 2 * kTextGap + layout_.row,
                                 .across = 0.5});
  }

  void Legend(const FigurePanel& panel, const PanelPlace& place) const {
    const std::vector<const FigureCurve*> rows = LegendOf(panel);
    if (rows.empty()) return;
    const double column = (layout_.width - place.left) / static_cast<double>(place.legend_columns);
    for (size_t k = 0; k < rows.size(); ++k) {
      const double x = place.left + column * static_cast<double>(k % place.legend_columns);
      const size_t line = k / place.legend_columns;
      const double y = place.legend_top + layout_.row * (0.5 + static_cast<double>(line));
      Sample(*rows[k], x, y);
      canvas_.Text(rows[k]->label, {.x = x + kSampleWidth + kSampleGap, .y = y, .down = 0.5});
    }
  }

  void Sample(const FigureCurve& curve, double x, double y) const {
    const std::string& color = ColorOf(style_, curve.look);
    if (curve.line) {
      canvas_.Line({{x, y}, {x + kSampleWidth, y}}, color, style_.line_pt,
                   DashesOf(style_, curve.look));
    }
    if (curve.marker < 0) return;
    canvas_.Mark(static_cast<Marker>(curve.marker % kMarkerShapes), x + 0.5 * kSampleWidth, y,
                 color);
  }

  void Map(const MapPlot& map, const PanelPlace& place) const {
    std::vector<Rgb> cells;
    for (int r = map.rows - 1; r >= 0; --r) {
      for (int c = 0; c < map.columns; ++c) {
        const size_t k = static_cast<size_t>(r) * static_cast<size_t>(map.columns);
        cells.push_back(CellColor(place.value, map.values[k + static_cast<size_t>(c)]));
      }
    }
    const double left = place.x.Px(map.x_min), right = place.x.Px(map.x_max);
    const double top = place.y.Px(map.y_max), bottom = place.y.Px(map.y_min);
    canvas_.Cells(left, top, right - left, bottom - top, map.columns, cells);
    Contours(map, place);
  }

  // Equal steps of the colours, through the middles of the cells.
  void Contours(const MapPlot& map, const PanelPlace& place) const {
    std::vector<double> inner;
    for (const double v : map.values) {
      inner.push_back(place.value.Shows(v) ? place.value.Inner(v) : kNan);
    }
    const double w = (map.x_max - map.x_min) / map.columns;
    const double h = (map.y_max - map.y_min) / map.rows;
    const auto at = [&](const std::array<double, 2>& p) {
      return std::pair{place.x.Px(map.x_min + (p[0] + 0.5) * w),
                       place.y.Px(map.y_min + (p[1] + 0.5) * h)};
    };
    for (int k = 1; k <= map.contours; ++k) {
      const double level =
          place.value.low + k * (place.value.high - place.value.low) / (map.contours + 1);
      for (const ContourPiece& piece : Contour(inner, map.columns, map.rows, level)) {
        canvas_.Line({at(piece.from), at(piece.to)}, "#ffffff", 0.5 * style_.line_pt);
      }
    }
  }

  void ColorBar(const MapPlot& map, const PanelPlace& place) const {
    constexpr int kSteps = 64;
    std::vector<Rgb> cells;
    for (int i = kSteps - 1; i >= 0; --i) cells.push_back(MapColor((i + 0.5) / kSteps));
    const double left = layout_.bar_left, right = left + layout_.bar_width;
    canvas_.Cells(left, place.top, layout_.bar_width, place.height, 1, cells);
    canvas_.Box(left, place.top, layout_.bar_width, place.height, style_.axis_pt);
    for (const FigureTick& tick : place.value_ticks) {
      const double y = place.value.Px(tick.value);
      canvas_.Line({{right, y}, {right - kTickLength, y}}, kBlack, style_.axis_pt);
      canvas_.Text(tick.text, {.x = right + kTextGap, .y = y, .down = 0.5});
    }
    canvas_.Text(map.value_label, {.x = right + 2 * kTextGap + layout_.bar_text_room,
                                   .y = place.top + 0.5 * place.height,
                                   .across = 0.5,
                                   .upwards = true});
  }

  const Figure& figure_;
  const FigureStyle& style_;
  const FigureLayout& layout_;
  const Canvas& canvas_;
};

}  // namespace

std::string DrawFigure(const Figure& figure, const FigureStyle& style, PictureFormat format) {
  const FigureLayout layout = LayOut(figure, style);
  return DrawPicture(
      format, style, layout.width, layout.height, figure.name,
      [&](const Canvas& canvas) { FigurePainter(figure, style, layout, canvas).Paint(); });
}

bool LacksGlyphs(const Figure& figure, const FigureStyle& style) {
  const Canvas canvas(style);
  for (const FigurePanel& panel : figure.panels) {
    for (const std::string& text : {panel.x.label, panel.y.label}) (void)canvas.Measure(text);
    for (const FigureCurve& curve : panel.curves) (void)canvas.Measure(curve.label);
    if (panel.map) (void)canvas.Measure(panel.map->value_label);
  }
  return canvas.lacks_glyphs();
}

}  // namespace mbv
