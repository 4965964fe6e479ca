// Texts as Pango lays them out, on paper as on a screen: nothing is fitted to pixels. Internal to
// text/ and figure/.
#pragma once

#include <string>

#include "text/cairo_handles.h"

namespace mbv::internal {

/// A text in Pango's markup, to be drawn on this cairo_t. `families` are fonts in the order of
/// preference, `size` is in the units of the cairo_t.
[[nodiscard]] Handle<PangoLayout> LayOut(cairo_t* cairo, const std::string& families, double size,
                                         const std::string& markup);

}  // namespace mbv::internal
