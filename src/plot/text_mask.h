// Texts as pixels.
#pragma once

#include <cairo.h>
#include <pango/pangocairo.h>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

// What cairo and Pango give is given back. Internal to text/ and figure/.

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

// The faces that journals ask for, else those of the same metrics; then Chinese (fonts-noto-cjk).

namespace mbv {

inline constexpr const char* kSerif =
    "Times New Roman, Liberation Serif, TeX Gyre Termes, Noto Serif CJK SC, serif";
inline constexpr const char* kSans =
    "Arial, Liberation Sans, TeX Gyre Heros, Noto Sans CJK SC, sans-serif";

}  // namespace mbv

// Texts as Pango lays them out, on paper as on a screen: nothing is fitted to pixels. Internal to
// text/ and figure/.

namespace mbv::internal {

/// A text in Pango's markup, to be drawn on this cairo_t. `families` are fonts in the order of
/// preference, `size` is in the units of the cairo_t.
[[nodiscard]] Handle<PangoLayout> LayOut(cairo_t* cairo, const std::string& families, double size,
                                         const std::string& markup);

}  // namespace mbv::internal

namespace mbv {

/// How much of each pixel a text covers, 0 … 255, first row on top.
struct TextMask {
  int width = 0, height = 0;
  std::vector<std::uint8_t> coverage = {};
};

/// Width of a UTF-8 text in one line of this height, ascent and descent together [px].
[[nodiscard]] double TextWidth(const std::string& text, double height_px);
/// The text in a sans-serif face. `shift_px` (0 … 1) moves it to the right.
[[nodiscard]] TextMask DrawText(const std::string& text, double height_px, double shift_px = 0.0);
/// Shortened with "…" until it is at most `room_px` wide; empty where not even that fits.
[[nodiscard]] std::string FittedText(std::string text, double height_px, double room_px);

}  // namespace mbv
