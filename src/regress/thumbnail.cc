// Thumbnails: PNG → smaller PNG → data URI.
#include <algorithm>
#include <cstdint>

#include "core/markup.h"
#include "image/png.h"
#include "regress/summaries.h"

namespace mbv {
namespace {

constexpr std::uint64_t kMostPixels = 1ULL << 26;  // 8192 × 8192, the largest that is drawn

// Mean of the pixels under each new one, in 32 levels per colour: small files.
Picture Shrink(const Picture& image, int width) {
  // a · b / c without overflow
  const auto share = [](int a, int b, int c) { return static_cast<int>(std::int64_t{a} * b / c); };
  Picture small;
  small.width = std::min(width, image.width);
  small.height = std::max(1, share(image.height, small.width, image.width));
  for (int y = 0; y < small.height; ++y) {
    const int y0 = share(y, image.height, small.height);
    const int y1 = std::max(y0 + 1, share(y + 1, image.height, small.height));
    for (int x = 0; x < small.width; ++x) {
      const int x0 = share(x, image.width, small.width);
      const int x1 = std::max(x0 + 1, share(x + 1, image.width, small.width));
      for (size_t c = 0; c < 3; ++c) {
        unsigned sum = 0;
        for (int v = y0; v < y1; ++v) {
          for (int u = x0; u < x1; ++u) {
            sum += image.rgb[3 * (static_cast<size_t>(v) * static_cast<size_t>(image.width) +
                                  static_cast<size_t>(u)) +
                             c];
          }
        }
        const unsigned mean = sum / static_cast<unsigned>((y1 - y0) * (x1 - x0));
        small.rgb.push_back(static_cast<std::uint8_t>((mean >> 3) * 255 / 31));
      }
    }
  }
  return small;
}

}  // namespace

std::string ThumbnailUri(const std::string& png, int width_px) {
  Picture picture;
  if (width_px < 1 || !DecodePng(png, kMostPixels, &picture)) return "";
  return "data:image/png;base64," + EncodeBase64(EncodePng(Shrink(picture, width_px)));
}

}  // namespace mbv
