// Figures as PDF, SVG and PNG: one drawing for all three.
#pragma once

#include <string>

#include "figure/canvas.h"
#include "figure/figure.h"
#include "figure/style.h"

namespace mbv {

/// The file's content. The same figure in the same style gives the same bytes where the same fonts
/// are installed.
[[nodiscard]] std::string DrawFigure(const Figure& figure, const FigureStyle& style,
                                     PictureFormat format);

/// Whether the fonts on this machine lack characters of its texts (Chinese without fonts-noto-cjk).
[[nodiscard]] bool LacksGlyphs(const Figure& figure, const FigureStyle& style);

}  // namespace mbv
