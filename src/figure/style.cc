#include "figure/style.h"

#include <cstdlib>

#include "text/fonts.h"

namespace mbv {
const std::vector<FigureStyle>& FigureStyles() {
  static const std::vector<FigureStyle> styles = {
      {.name = "ieee", .font = kSerif, .font_pt = 8.0, .width_mm = 88.9},
      {.name = "springer", .font = kSans, .font_pt = 8.0, .width_mm = 84.0},
      {.name = "plain", .font = kSans, .font_pt = 9.0, .width_mm = 120.0}};
  return styles;
}

const FigureStyle* FindFigureStyle(const std::string& name) {
  for (const FigureStyle& style : FigureStyles()) {
    if (style.name == name) return &style;
  }
  return nullptr;
}

const std::string& ColorOf(const FigureStyle& style, int look) {
  static const std::string black = "#000000";
  if (look < 0) return black;
  return style.colors[static_cast<size_t>(look) % style.colors.size()];
}

const std::vector<double>& DashesOf(const FigureStyle& style, int look) {
  static const std::vector<double> solid;
  if (look < 0) return solid;
  return style.dashes[static_cast<size_t>(look) % style.dashes.size()];
}

std::array<double, 3> RgbOf(const std::string& color) {
  std::array<double, 3> rgb{};
  for (size_t k = 0; k < 3; ++k) {
    rgb[k] =
        static_cast<double>(std::strtol(color.substr(1 + 2 * k, 2).c_str(), nullptr, 16)) / 255.0;
  }
  return rgb;
}

}  // namespace mbv
