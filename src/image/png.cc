// By libpng's simplified interface.
#include "image/png.h"

#include <png.h>

#include "core/demand.h"

namespace mbv {

std::string EncodePng(const Picture& picture) {
  MBV_DEMAND(picture.width > 0 && picture.height > 0, picture.width);
  MBV_DEMAND(picture.rgb.size() == 3UL * picture.width * picture.height, picture.rgb.size());
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  // The size that always suffices, then the size it took.
  png_alloc_size_t bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string png(bytes, '\0');
  const int ok =
      png_image_write_to_memory(&image, png.data(), &bytes, 0, picture.rgb.data(), 0, nullptr);
  MBV_DEMAND(ok != 0, std::string(image.message));
  png.resize(bytes);
  return png;
}

bool DecodePng(const std::string& png, std::uint64_t most_pixels, Picture* picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, png.data(), png.size()) == 0) return false;
  if (std::uint64_t{image.width} * image.height > most_pixels) {
    png_image_free(&image);
    return false;
  }
  image.format = PNG_FORMAT_RGB;
  picture->width = static_cast<int>(image.width);
  picture->height = static_cast<int>(image.height);
  picture->rgb.resize(PNG_IMAGE_SIZE(image));
  return png_image_finish_read(&image, nullptr, picture->rgb.data(), 0, nullptr) != 0;
}

}  // namespace mbv
