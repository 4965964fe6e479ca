// Thumbnails: PNG → smaller PNG → data URI.
#include <png.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/markup.h"
#include "regress/summaries.h"

namespace mbv {
namespace {

constexpr std::uint64_t kMostPixels = 1ULL << 26;  // 8192 × 8192, the largest that is drawn

struct Image {
  unsigned width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

bool Decode(const std::string& png, Image* image) {
  png_image reader{};
  reader.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&reader, png.data(), png.size()) == 0) return false;
  if (std::uint64_t{reader.width} * reader.height > kMostPixels) {
    png_image_free(&reader);
    return false;
  }
  reader.format = PNG_FORMAT_RGB;
  image->width = reader.width;
  image->height = reader.height;
  image->rgb.resize(PNG_IMAGE_SIZE(reader));
  return png_image_finish_read(&reader, nullptr, image->rgb.data(), 0, nullptr) != 0;
}

// Mean of the pixels under each new one, in 32 levels per colour: small files.
Image Shrink(const Image& image, unsigned width) {
  Image small;
  small.width = std::min(width, image.width);
  small.height = std::max(1U, image.height * small.width / image.width);
  for (unsigned y = 0; y < small.height; ++y) {
    const unsigned y0 = y * image.height / small.height;
    const unsigned y1 = std::max(y0 + 1, (y + 1) * image.height / small.height);
    for (unsigned x = 0; x < small.width; ++x) {
      const unsigned x0 = x * image.width / small.width;
      const unsigned x1 = std::max(x0 + 1, (x + 1) * image.width / small.width);
      for (unsigned c = 0; c < 3; ++c) {
        unsigned sum = 0;
        for (unsigned v = y0; v < y1; ++v) {
          for (unsigned u = x0; u < x1; ++u) sum += image.rgb[3UL * (v * image.width + u) + c];
        }
        const unsigned mean = sum / ((y1 - y0) * (x1 - x0));
        small.rgb.push_back(static_cast<std::uint8_t>((mean >> 3) * 255 / 31));
      }
    }
  }
  return small;
}

std::string EncodeImage(const Image& image) {
  png_image writer{};
  writer.version = PNG_IMAGE_VERSION;
  writer.width = image.width;
  writer.height = image.height;
  writer.format = PNG_FORMAT_RGB;
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(writer);
  std::string png(bytes, '\0');
  if (png_image_write_to_memory(&writer, png.data(), &bytes, 0, image.rgb.data(), 0, nullptr) ==
      0) {
    return "";
  }
  png.resize(bytes);
  return png;
}

}  // namespace

std::string ThumbnailUri(const std::string& png, int width_px) {
  Image image;
  if (width_px < 1 || !Decode(png, &image)) return "";
  const std::string small = EncodeImage(Shrink(image, static_cast<unsigned>(width_px)));
  return small.empty() ? "" : "data:image/png;base64," + EncodeBase64(small);
}

}  // namespace mbv
