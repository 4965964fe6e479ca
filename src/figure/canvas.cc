#include "figure/canvas.h"

#include <cmath>
#include <cstdint>
#include <numbers>

#include "figure/markup.h"
#include "text/text_layout.h"

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

void Canvas::Clipped(double x, double y, double width, double height,
                     const std::function<void()>& draw) const {
  cairo_save(pen_->cairo);
  cairo_rectangle(pen_->cairo, x, y, width, height);
  cairo_clip(pen_->cairo);
  draw();
  cairo_restore(pen_->cairo);
}

}  // namespace mbv
