// The caption bar under a picture: text, verdict and a legend, painted over finished pixels.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "render/render.h"

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
/// Paints bar, texts and legend onto the picture's lower edge. Text too long for its place is
/// shortened with "…".
void PaintCaption(const Caption& caption, const std::vector<LegendEntry>& legend, Picture* picture);

}  // namespace mbv::render
