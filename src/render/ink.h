// Painting over finished pixels: surfaces, lines and texts. Internal to render/.
#pragma once

#include <array>
#include <string>

#include "core/types.h"
#include "image/png.h"

namespace mbv::render {

/// Display values 0 … 1.
using Ink = std::array<float, 3>;
inline constexpr Ink kInk{0.10F, 0.11F, 0.13F}, kSoftInk{0.33F, 0.35F, 0.38F};
inline constexpr Ink kPaper{1.0F, 1.0F, 1.0F};

/// What heights of texts are fractions of [px].
[[nodiscard]] double TextUnit(const std::array<int, 2>& size_px);
inline constexpr double kSmallText = 0.0215;  ///< height of a legend's line

// What lies beyond the picture is left out. Over a transparent pixel the colour's share counts as
// opacity.
void Blend(Picture* picture, int x, int y, const Ink& color, float share);
void Fill(Picture* picture, int left, int top, int width, int height, const Ink& color,
          float share = 1.0F);
void Stroke(Picture* picture, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
            const Ink& color);
/// One line of text of this height.
void Write(const std::string& text, double left, double top, double height_px, const Ink& color,
           Picture* picture);

}  // namespace mbv::render
