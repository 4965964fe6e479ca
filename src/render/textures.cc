#include "render/textures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbv::render {
namespace {

void Put(std::vector<std::uint8_t>* rgb, std::size_t pixel, double r, double g, double b) {
  const double values[] = {r, g, b};
  for (int i = 0; i < 3; ++i) {
    (*rgb)[3 * pixel + i] = static_cast<std::uint8_t>(std::clamp(values[i], 0.0, 1.0) * 255.0);
  }
}

}  // namespace

std::vector<std::uint8_t> WaterTexture(int size) {
  // Waves of whole numbers of periods per tile, so that tiles join.
  struct Wave {
    int kx, ky;
    double phase, height;
  };
  const Wave waves[] = {{3, 1, 0.3, 0.9},   {-2, 4, 1.9, 0.8},   {6, -3, 4.0, 0.6},
                        {5, 7, 0.8, 0.5},   {-9, 4, 2.7, 0.45},  {11, 9, 5.1, 0.35},
                        {-7, 15, 3.3, 0.3}, {19, -8, 1.2, 0.25}, {-16, -21, 0.1, 0.2},
                        {27, 18, 2.2, 0.16}};
  std::vector<std::uint8_t> rgb(3UL * size * size);
  // Whole periods: a wave takes `size` values only.
  const double unit = 2.0 * std::numbers::pi / size;
  std::vector<std::vector<double>> heights;
  for (const Wave& wave : waves) {
    heights.emplace_back();
    for (int i = 0; i < size; ++i) {
      heights.back().push_back(wave.height * std::sin(unit * i + wave.phase));
    }
  }
  const auto place = [size](int at) { return static_cast<std::size_t>((at % size + size) % size); };
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      double height = 0.0;
      for (std::size_t k = 0; k < heights.size(); ++k) {
        height += heights[k][place(waves[k].kx * x + waves[k].ky * y)];
      }
      // Crests are narrow and light, troughs broad and dark.
      const double crest = std::exp(0.75 * height - 1.2);
      const double light = std::min(0.035 * height + 0.10 * crest, 0.30);
      Put(&rgb, static_cast<std::size_t>(y) * size + x, 0.15 + light, 0.33 + light,
          0.44 + 0.95 * light);
    }
  }
  return rgb;
}

}  // namespace mbv::render
