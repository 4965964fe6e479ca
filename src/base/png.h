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
  /// Opacity, a byte per pixel, by which `rgb` is not multiplied; empty: opaque.
  std::vector<std::uint8_t> alpha = {};
};

/// A PNG file's content, RGB or RGBA; the picture must have its size.
[[nodiscard]] std::string EncodePng(const Picture& picture);

/// The picture in a PNG file's content, as it looks on white; false if it is none, or has more than
/// `most_pixels`.
[[nodiscard]] bool DecodePng(const std::string& png, std::uint64_t most_pixels, Picture* picture);

/// The picture as it looks on white, opaque.
[[nodiscard]] Picture OnWhite(const Picture& picture);

}  // namespace mbv
