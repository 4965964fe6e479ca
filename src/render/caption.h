// The caption bar under a picture: text, verdict and a legend, painted over finished pixels.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "render/render.h"
#include "render/stage.h"

namespace mbv::render {

/// One entry of the legend: a coloured mark and its meaning.
struct LegendEntry {
  std::string color = {};  ///< material name; empty: text alone
  std::string text = {};
  int row = 0;  ///< 0 or 1
};

/// True when there is nothing to write.
[[nodiscard]] bool IsEmpty(const Caption& caption);
/// Height of the bar for a picture of this height [px]; 0 for an empty caption.
[[nodiscard]] int BarHeight(const Caption& caption, const std::array<int, 2>& size_px);
/// Text in the renderer's character set (32 … 126): "°" becomes " deg", "²" "^2", "µ" "u", ….
[[nodiscard]] std::string PlainText(const std::string& utf8);

/// Paints bar, texts and legend onto the picture's lower edge. Text too long for its place is
/// shortened with "...".
void PaintCaption(const Caption& caption, const std::vector<LegendEntry>& legend,
                  const std::vector<Glyph>& font, Picture* picture);

/// A name to be written at a place in the picture.
struct Label {
  double x = 0.0, y = 0.0;  ///< of what is named, fractions of width and height
  std::string text = {};
};

/// Writes names beside their places on a pale ground, the first ones first; what would lie over
/// another, leave the picture or lie in the caption is left out.
void PaintLabels(const std::vector<Label>& labels, const Caption& caption,
                 const std::vector<Glyph>& font, Picture* picture);

}  // namespace mbv::render
