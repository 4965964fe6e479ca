#include "plot/draw.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>

#include "base/demand.h"
#include "base/png.h"
#include "plot/layout.h"
#include "plot/svg_plot.h"
#include "plot/text_mask.h"

namespace mbv {

namespace {

using internal::Handle;

void SetColor(cairo_t* cairo, const std::string& color) {
  const auto [r, g, b] = RgbOf(color);
  cairo_set_source_rgb(cairo, r, g, b);
}

bool IsFinite(const std::pair<double, double>& point) {
  return std::isfinite(point.first) && std::isfinite(point.second);
}

constexpr const char* kInk = "#000000";

}  // namespace

struct Canvas::Pen {
  Handle<cairo_surface_t> own_surface;
  Handle<cairo_t> own_cairo;
  cairo_t* cairo = nullptr;
  bool lacks_glyphs = false;

  Handle<PangoLayout> LayOut(const FigureStyle& style, const std::string& text, double scale) {
    const double size = scale * style.font_pt;
    Handle<PangoLayout> layout = internal::LayOut(cairo, style.font, size, ToPango(text, size));
    lacks_glyphs = lacks_glyphs || pango_layout_get_unknown_glyphs_count(layout.get()) > 0;
    return layout;
  }
};

Canvas::Canvas(const FigureStyle& style) : pen_(std::make_unique<Pen>()), style_(style) {
  pen_->own_surface.reset(cairo_recording_surface_create(CAIRO_CONTENT_COLOR_ALPHA, nullptr));
  pen_->own_cairo.reset(cairo_create(pen_->own_surface.get()));
  pen_->cairo = pen_->own_cairo.get();
}

Canvas::Canvas(const FigureStyle& style, void* cairo)
    : pen_(std::make_unique<Pen>()), style_(style) {
  pen_->cairo = static_cast<cairo_t*>(cairo);
}

Canvas::~Canvas() = default;

bool Canvas::lacks_glyphs() const { return pen_->lacks_glyphs; }

TextSize Canvas::Measure(const std::string& text, double scale) const {
  const Handle<PangoLayout> layout = pen_->LayOut(style_, text, scale);
  int width = 0, height = 0;
  pango_layout_get_size(layout.get(), &width, &height);
  return {static_cast<double>(width) / PANGO_SCALE, static_cast<double>(height) / PANGO_SCALE};
}

void Canvas::Text(const std::string& text, const TextPlace& place, double scale) const {
  const TextSize size = Measure(text, scale);
  const Handle<PangoLayout> layout = pen_->LayOut(style_, text, scale);
  cairo_t* cairo = pen_->cairo;
  cairo_save(cairo);
  SetColor(cairo, kInk);
  cairo_translate(cairo, place.x, place.y);
  if (place.upwards) cairo_rotate(cairo, -std::numbers::pi / 2);
  cairo_move_to(cairo, -place.across * size.width, -place.down * size.height);
  pango_cairo_show_layout(cairo, layout.get());
  cairo_restore(cairo);
}

void Canvas::Line(const FigurePoints& points, const std::string& color, double width_pt,
                  const std::vector<double>& dashes) const {
  cairo_t* cairo = pen_->cairo;
  std::vector<double> lengths;
  lengths.reserve(dashes.size());
  for (const double length : dashes) lengths.push_back(length * width_pt);
  cairo_set_dash(cairo, lengths.data(), static_cast<int>(lengths.size()), 0);
  cairo_set_line_width(cairo, width_pt);
  cairo_set_line_join(cairo, CAIRO_LINE_JOIN_ROUND);
  SetColor(cairo, color);
  bool down = false;
  FigurePoints alone;  // between gaps: a stroke would not show them
  for (size_t k = 0; k < points.size(); ++k) {
    const auto& [x, y] = points[k];
    const bool next = k + 1 < points.size() && IsFinite(points[k + 1]);
    if (IsFinite(points[k])) (down ? cairo_line_to : cairo_move_to)(cairo, x, y);
    if (IsFinite(points[k]) && !down && !next) alone.push_back(points[k]);
    down = IsFinite(points[k]);
  }
  cairo_stroke(cairo);
  cairo_set_dash(cairo, nullptr, 0, 0);
  for (const auto& [x, y] : alone) {
    cairo_arc(cairo, x, y, width_pt, 0, 2 * std::numbers::pi);
    cairo_fill(cairo);
  }
}

void Canvas::Mark(Marker shape, double x, double y, const std::string& color) const {
  cairo_t* cairo = pen_->cairo;
  const double r = 0.5 * style_.marker_pt;
  cairo_new_path(cairo);
  const auto polygon = [&](const FigurePoints& corners) {
    for (const auto& [u, v] : corners) cairo_line_to(cairo, x + r * u, y + r * v);
    cairo_close_path(cairo);
  };
  const auto strokes = [&](const FigurePoints& ends) {
    for (const auto& [u, v] : ends) {
      cairo_move_to(cairo, x - r * u, y - r * v);
      cairo_line_to(cairo, x + r * u, y + r * v);
    }
  };
  switch (shape) {
    case Marker::kCircle:
      cairo_arc(cairo, x, y, r, 0, 2 * std::numbers::pi);
      break;
    case Marker::kSquare:
      polygon({{-0.9, -0.9}, {0.9, -0.9}, {0.9, 0.9}, {-0.9, 0.9}});
      break;
    case Marker::kTriangle:
      polygon({{0, -1.2}, {1.1, 0.8}, {-1.1, 0.8}});
      break;
    case Marker::kDiamond:
      polygon({{0, -1.3}, {1.1, 0}, {0, 1.3}, {-1.1, 0}});
      break;
    case Marker::kCross:
      strokes({{0.9, 0.9}, {0.9, -0.9}});
      break;
    case Marker::kPlus:
      strokes({{1.1, 0}, {0, 1.1}});
      break;
  }
  if (shape != Marker::kCross && shape != Marker::kPlus) {
    SetColor(cairo, "#ffffff");
    cairo_fill_preserve(cairo);
  }
  cairo_set_line_width(cairo, 0.75 * style_.line_pt);
  SetColor(cairo, color);
  cairo_stroke(cairo);
}

void Canvas::Box(double x, double y, double width, double height, double width_pt) const {
  SetColor(pen_->cairo, kInk);
  cairo_set_line_width(pen_->cairo, width_pt);
  cairo_set_line_join(pen_->cairo, CAIRO_LINE_JOIN_MITER);
  cairo_rectangle(pen_->cairo, x, y, width, height);
  cairo_stroke(pen_->cairo);
}

void Canvas::Cells(double x, double y, double width, double height, int columns,
                   const std::vector<Rgb>& cells) const {
  const int rows = static_cast<int>(cells.size()) / columns;
  const Handle<cairo_surface_t> image(
      cairo_image_surface_create(CAIRO_FORMAT_ARGB32, columns, rows));
  unsigned char* data = cairo_image_surface_get_data(image.get());
  const int stride = cairo_image_surface_get_stride(image.get());
  for (size_t k = 0; k < cells.size(); ++k) {
    const int r = static_cast<int>(k) / columns, c = static_cast<int>(k) % columns;
    auto* row = reinterpret_cast<std::uint32_t*>(data + static_cast<ptrdiff_t>(r) * stride);
    const Rgb& rgb = cells[k];
    row[c] = rgb[0] < 0 ? 0U
                        : 0xff000000U | static_cast<std::uint32_t>(rgb[0]) << 16U |
                              static_cast<std::uint32_t>(rgb[1]) << 8U |
                              static_cast<std::uint32_t>(rgb[2]);
  }
  cairo_surface_mark_dirty(image.get());
  cairo_save(pen_->cairo);
  cairo_translate(pen_->cairo, x, y);
  cairo_scale(pen_->cairo, width / columns, height / rows);
  cairo_set_source_surface(pen_->cairo, image.get(), 0, 0);
  cairo_pattern_set_filter(cairo_get_source(pen_->cairo), CAIRO_FILTER_NEAREST);
  cairo_paint(pen_->cairo);
  cairo_restore(pen_->cairo);
}

void Canvas::NextPage() const { cairo_show_page(pen_->cairo); }

void Canvas::Clipped(double x, double y, double width, double height,
                     const std::function<void()>& draw) const {
  cairo_save(pen_->cairo);
  cairo_rectangle(pen_->cairo, x, y, width, height);
  cairo_clip(pen_->cairo);
  draw();
  cairo_restore(pen_->cairo);
}

namespace {

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
    for (const auto& [curve, x, y] : LegendPlaces(layout_, panel, place)) {
      Sample(*curve, x, y);
      canvas_.Text(curve->label, {.x = x + kSampleWidth + kSampleGap, .y = y, .down = 0.5});
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

// Files of drawings.

namespace {

using internal::Handle;

constexpr double kPerInch = 72.0;  // points

cairo_status_t Append(void* text, const unsigned char* bytes, unsigned count) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(bytes), count);
  return CAIRO_STATUS_SUCCESS;
}

// Cairo counts its surfaces through the whole program: "image12" in one drawing is "image19" in
// the next. Counted anew in the order in which they are named.
std::string Renumbered(const std::string& svg) {
  std::string out;
  std::map<std::string, std::string> names;
  size_t from = 0;
  for (size_t at = 0; at < svg.size(); ++at) {
    for (const std::string word :
         {"\"image", "#image", "\"surface", "#surface", "\"clip", "#clip"}) {
      if (svg.compare(at, word.size(), word) != 0) continue;
      size_t end = at + word.size();
      while (end < svg.size() && std::isdigit(static_cast<unsigned char>(svg[end])) != 0) ++end;
      if (end == at + word.size()) continue;
      const std::string name = svg.substr(at + 1, end - at - 1);
      const auto known = names.emplace(name, word.substr(1) + std::to_string(names.size())).first;
      out += svg.substr(from, at + 1 - from) + known->second;
      from = end;
    }
  }
  return out + svg.substr(from);
}

std::string PngOf(cairo_surface_t* surface) {
  cairo_surface_flush(surface);
  Picture picture{.width = cairo_image_surface_get_width(surface),
                  .height = cairo_image_surface_get_height(surface)};
  const unsigned char* row = cairo_image_surface_get_data(surface);
  for (int y = 0; y < picture.height; ++y, row += cairo_image_surface_get_stride(surface)) {
    for (int x = 0; x < picture.width; ++x) {
      const std::uint32_t pixel = reinterpret_cast<const std::uint32_t*>(row)[x];
      for (const int shift : {16, 8, 0}) {
        picture.rgb.push_back(static_cast<std::uint8_t>(pixel >> shift));
      }
    }
  }
  return EncodePng(picture);
}

std::string DrawVector(bool pdf, const FigureStyle& style, double width, double height,
                       const std::string& title, const std::function<void(const Canvas&)>& draw) {
  std::string bytes;
  const Handle<cairo_surface_t> surface(
      pdf ? cairo_pdf_surface_create_for_stream(Append, &bytes, width, height)
          : cairo_svg_surface_create_for_stream(Append, &bytes, width, height));
  if (pdf) {
    cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, title.c_str());
    // No date: the bytes follow from the drawing alone.
    cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, "");
  }
  const Handle<cairo_t> cairo(cairo_create(surface.get()));
  draw(Canvas(style, cairo.get()));
  cairo_surface_finish(surface.get());
  const cairo_status_t status = cairo_surface_status(surface.get());
  MBV_DEMAND(status == CAIRO_STATUS_SUCCESS, cairo_status_to_string(status));
  return pdf ? bytes : Renumbered(bytes);
}

std::string DrawPixels(const FigureStyle& style, double width, double height,
                       const std::function<void(const Canvas&)>& draw) {
  const double scale = style.dpi / kPerInch;
  const Handle<cairo_surface_t> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::ceil(width * scale)),
                                 static_cast<int>(std::ceil(height * scale))));
  const Handle<cairo_t> cairo(cairo_create(surface.get()));
  MBV_DEMAND(cairo_status(cairo.get()) == CAIRO_STATUS_SUCCESS, width);
  cairo_set_source_rgb(cairo.get(), 1, 1, 1);
  cairo_paint(cairo.get());
  cairo_scale(cairo.get(), scale, scale);
  draw(Canvas(style, cairo.get()));
  return PngOf(surface.get());
}

}  // namespace

std::string DrawPicture(PictureFormat format, const FigureStyle& style, double width, double height,
                        const std::string& title, const std::function<void(const Canvas&)>& draw) {
  if (format == PictureFormat::kPng) return DrawPixels(style, width, height, draw);
  return DrawVector(format == PictureFormat::kPdf, style, width, height, title, draw);
}

}  // namespace mbv
