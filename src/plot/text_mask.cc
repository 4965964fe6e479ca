#include "plot/text_mask.h"

#include <cmath>

namespace mbv::internal {
namespace {

constexpr double kPointsPerInch = 72.0;

void LeaveUnhinted(PangoContext* context) {
  const Handle<cairo_font_options_t> options(cairo_font_options_create());
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  pango_cairo_context_set_font_options(context, options.get());
  pango_context_set_round_glyph_positions(context, FALSE);
  pango_cairo_context_set_resolution(context, kPointsPerInch);
}

}  // namespace

Handle<PangoLayout> LayOut(cairo_t* cairo, const std::string& families, double size,
                           const std::string& markup) {
  Handle<PangoLayout> layout(pango_cairo_create_layout(cairo));
  LeaveUnhinted(pango_layout_get_context(layout.get()));
  const Handle<PangoFontDescription> font(pango_font_description_new());
  pango_font_description_set_family(font.get(), families.c_str());
  pango_font_description_set_size(font.get(), static_cast<int>(std::lround(size * PANGO_SCALE)));
  pango_layout_set_font_description(layout.get(), font.get());
  pango_layout_set_markup(layout.get(), markup.c_str(), -1);
  return layout;
}

}  // namespace mbv::internal

namespace mbv {
namespace {

using internal::Handle;

constexpr double kLine = 1.15;  // height of a line of kSans over the font's size

struct Surface {
  explicit Surface(int width, int height)
      : image(cairo_image_surface_create(CAIRO_FORMAT_A8, width, height)),
        cairo(cairo_create(image.get())) {}
  Handle<cairo_surface_t> image;
  Handle<cairo_t> cairo;
};

Handle<PangoLayout> LineOf(const std::string& text, double height_px, cairo_t* cairo) {
  const Handle<char> escaped(g_markup_escape_text(text.c_str(), -1));
  return internal::LayOut(cairo, kSans, height_px / kLine, escaped.get());
}

double WidthOf(PangoLayout* line) {
  int width = 0, height = 0;
  pango_layout_get_size(line, &width, &height);
  return static_cast<double>(width) / PANGO_SCALE;
}

}  // namespace

double TextWidth(const std::string& text, double height_px) {
  const Surface surface(1, 1);
  return WidthOf(LineOf(text, height_px, surface.cairo.get()).get());
}

TextMask DrawText(const std::string& text, double height_px, double shift_px) {
  const double width = std::ceil(TextWidth(text, height_px) + shift_px) + 1.0;
  TextMask mask{.width = static_cast<int>(width),
                .height = static_cast<int>(std::ceil(1.2 * height_px)) + 1};
  const Surface surface(mask.width, mask.height);
  const Handle<PangoLayout> line = LineOf(text, height_px, surface.cairo.get());
  cairo_move_to(surface.cairo.get(), shift_px, 0.0);
  pango_cairo_show_layout(surface.cairo.get(), line.get());
  cairo_surface_flush(surface.image.get());
  const unsigned char* row = cairo_image_surface_get_data(surface.image.get());
  for (int y = 0; y < mask.height; ++y) {
    mask.coverage.insert(mask.coverage.end(), row, row + mask.width);
    row += cairo_image_surface_get_stride(surface.image.get());
  }
  return mask;
}

std::string FittedText(std::string text, double height_px, double room_px) {
  if (TextWidth(text, height_px) <= room_px) return text;
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) >> 6) == 2; };
  while (!text.empty() && TextWidth(text + "…", height_px) > room_px) {
    while (text.size() > 1 && continues(text.back())) text.pop_back();
    text.pop_back();
  }
  return text.empty() ? text : text + "…";
}

}  // namespace mbv
