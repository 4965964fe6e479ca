// Written row by row, so that a large picture is not in memory twice; read by libpng's simplified
// interface.
#include "base/png.h"

#include <png.h>

#include "base/demand.h"

namespace mbv {
namespace {

// Drawn pictures are no smaller with filters than without, and those take as long again. Without:
// level 4 332 kB in 31 ms, level 6 306 kB in 45 ms, level 9 297 kB in 131 ms; with all filters and
// level 6, libpng's usual, 322 kB in 100 ms (means of three pictures of 1280 x 960).
constexpr int kLevel = 4, kFilters = PNG_FILTER_NONE;

void AppendBytes(png_structp png, png_bytep bytes, png_size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<char*>(bytes), count);
}

[[noreturn]] void Fail(png_structp /*png*/, png_const_charp message) {
  throw InternalError(std::string("libpng: ") + message);
}

struct PngWriter {
  PngWriter() : info(png_create_info_struct(png)) {
    MBV_DEMAND(png != nullptr && info != nullptr, "libpng");
  }
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  ~PngWriter() { png_destroy_write_struct(&png, &info); }

  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, Fail, nullptr);
  png_infop info;
};

// Row y as it goes into the file.
void FillRow(const Picture& picture, int y, std::vector<std::uint8_t>* row) {
  const auto width = static_cast<std::size_t>(picture.width);
  const std::size_t first = width * static_cast<std::size_t>(y);
  for (std::size_t x = 0; x < width; ++x) {
    for (std::size_t i = 0; i < 3; ++i) (*row)[4 * x + i] = picture.rgb[3 * (first + x) + i];
    (*row)[4 * x + 3] = picture.alpha[first + x];
  }
}

}  // namespace

std::string EncodePng(const Picture& picture) {
  MBV_DEMAND(picture.width > 0 && picture.height > 0, picture.width);
  const auto pixels =
      static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  MBV_DEMAND(picture.rgb.size() == 3 * pixels, picture.rgb.size());
  const bool opaque = picture.alpha.empty();
  MBV_DEMAND(opaque || picture.alpha.size() == pixels, picture.alpha.size());
  std::string bytes;
  const PngWriter writer;
  png_set_write_fn(writer.png, &bytes, AppendBytes, nullptr);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(picture.width),
               static_cast<png_uint_32>(picture.height), 8,
               opaque ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGBA, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(writer.png, kLevel);
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, kFilters);
  png_write_info(writer.png, writer.info);
  std::vector<std::uint8_t> row(opaque ? 0 : 4UL * static_cast<std::size_t>(picture.width));
  for (int y = 0; y < picture.height; ++y) {
    if (!opaque) FillRow(picture, y, &row);
    const std::size_t first =
        3UL * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(y);
    png_write_row(writer.png, opaque ? picture.rgb.data() + first : row.data());
  }
  png_write_end(writer.png, nullptr);
  return bytes;
}

bool DecodePng(const std::string& png, std::uint64_t most_pixels, Picture* picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, png.data(), png.size()) == 0) return false;
  if (std::uint64_t{image.width} * image.height > most_pixels) {
    png_image_free(&image);
    return false;
  }
  image.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> rgba(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, rgba.data(), 0, nullptr) == 0) return false;
  Picture read{.width = static_cast<int>(image.width), .height = static_cast<int>(image.height)};
  read.rgb.reserve(rgba.size() / 4 * 3);
  for (std::size_t at = 0; at < rgba.size(); at += 4) {
    for (std::size_t i = at; i < at + 3; ++i) read.rgb.push_back(rgba[i]);
    read.alpha.push_back(rgba[at + 3]);
  }
  *picture = OnWhite(read);
  return true;
}

Picture OnWhite(const Picture& picture) {
  Picture flat = picture;
  flat.alpha.clear();
  for (std::size_t k = 0; k < picture.alpha.size(); ++k) {
    const int alpha = picture.alpha[k];
    for (std::size_t i = 3 * k; i < 3 * k + 3; ++i) {
      flat.rgb[i] =
          static_cast<std::uint8_t>((alpha * picture.rgb[i] + (255 - alpha) * 255 + 127) / 255);
    }
  }
  return flat;
}

}  // namespace mbv
