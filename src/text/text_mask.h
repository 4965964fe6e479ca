// Texts as pixels.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace mbv {

/// How much of each pixel a text covers, 0 … 255, first row on top.
struct TextMask {
  int width = 0, height = 0;
  std::vector<std::uint8_t> coverage = {};
};

/// Width of a UTF-8 text in one line of this height, ascent and descent together [px].
[[nodiscard]] double TextWidth(const std::string& text, double height_px);
/// The text in a sans-serif face. `shift_px` (0 … 1) moves it to the right.
[[nodiscard]] TextMask DrawText(const std::string& text, double height_px, double shift_px = 0.0);
/// Shortened with "…" until it is at most `room_px` wide; empty where not even that fits.
[[nodiscard]] std::string FittedText(std::string text, double height_px, double room_px);

}  // namespace mbv
