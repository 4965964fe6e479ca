#include "render/ink.h"

#include <algorithm>
#include <cmath>

#include "text/text_mask.h"

namespace mbv::render {

double TextUnit(const std::array<int, 2>& size_px) {
  return std::min(size_px[0] * 0.75, static_cast<double>(size_px[1]));
}

// Lays a colour over a pixel; over a transparent one it makes it opaque as far as it covers it.
void Blend(Picture* picture, int x, int y, const Ink& color, float share) {
  if (x < 0 || y < 0 || x >= picture->width || y >= picture->height) return;
  const auto at = static_cast<std::size_t>(y) * picture->width + x;
  const float below =
      (1.0F - share) * (picture->alpha.empty() ? 1.0F : picture->alpha[at] / 255.0F);
  const float all = share + below;
  if (all <= 0.0F) return;
  std::uint8_t* pixel = picture->rgb.data() + 3 * at;
  for (int i = 0; i < 3; ++i) {
    const float value = (share * color[i] * 255.0F + below * pixel[i]) / all;
    pixel[i] = static_cast<std::uint8_t>(std::lround(value));
  }
  if (!picture->alpha.empty()) {
    picture->alpha[at] = static_cast<std::uint8_t>(std::lround(255.0F * all));
  }
}

void Fill(Picture* picture, int left, int top, int width, int height, const Ink& color,
          float share) {
  for (int y = top; y < top + height; ++y) {
    for (int x = left; x < left + width; ++x) Blend(picture, x, y, color, share);
  }
}

// A line of a pixel's width or two.
void Stroke(Picture* picture, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
            const Ink& color) {
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from).cwiseAbs().maxCoeff())));
  const int thick = std::max(1, picture->height / 960);
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d p = from + (to - from) * i / steps;
    Fill(picture, static_cast<int>(p.x()), static_cast<int>(p.y()), thick, thick, color);
  }
}

void Write(const std::string& text, double left, double top, double height_px, const Ink& color,
           Picture* picture) {
  const double whole = std::floor(left);
  const TextMask mask = DrawText(text, height_px, left - whole);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const std::uint8_t share = mask.coverage[static_cast<std::size_t>(y) * mask.width + x];
      if (share == 0) continue;
      Blend(picture, static_cast<int>(whole) + x, static_cast<int>(std::lround(top)) + y, color,
            static_cast<float>(share) / 255.0F);
    }
  }
}

}  // namespace mbv::render
