// What cairo and Pango give is given back. Internal to text/ and figure/.
#pragma once

#include <cairo.h>
#include <pango/pangocairo.h>

#include <memory>

namespace mbv::internal {

struct Unref {
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
  void operator()(cairo_t* cairo) const { cairo_destroy(cairo); }
  void operator()(PangoLayout* layout) const { g_object_unref(layout); }
  void operator()(PangoFontDescription* font) const { pango_font_description_free(font); }
  void operator()(cairo_font_options_t* options) const { cairo_font_options_destroy(options); }
  void operator()(char* text) const { g_free(text); }
};
template <typename T>
using Handle = std::unique_ptr<T, Unref>;

}  // namespace mbv::internal
