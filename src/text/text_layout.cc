#include "text/text_layout.h"

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
