// Pictures as pixels, and PNG files of them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace mbv {

/// An RGB image, top row first, 3 bytes per pixel.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb = {};
};

/// A PNG file's content; the picture must have its size.
[[nodiscard]] std::string EncodePng(const Picture& picture);

/// The picture in a PNG file's content; false if it is none, or has more than `most_pixels`.
[[nodiscard]] bool DecodePng(const std::string& png, std::uint64_t most_pixels, Picture* picture);

}  // namespace mbv
