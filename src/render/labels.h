// Names and a scale, painted over finished pixels.
#pragma once

#include <string>
#include <vector>

#include "image/png.h"

namespace mbv::render {

/// A name to be written at a place in the picture.
struct Label {
  double x = 0.0, y = 0.0;  ///< of what is named, fractions of width and height
  std::string text = {};
};

/// Writes names beside their places on a pale ground, the first ones first; where the room is taken
/// farther away, with a line to the place. Places outside of the picture are not named. `floor_px`
/// is where a caption begins. Returns how many found no room.
int PaintLabels(const std::vector<Label>& labels, int floor_px, Picture* picture);

/// 1, 2 or 5 times a power of ten, not above `value`.
[[nodiscard]] double RoundLength(double value);

/// A bar of a round length, at most a quarter as long as the picture is wide, in its lower right
/// corner above `floor_px`. `height_m` is what the picture's height shows in the plane through the
/// look-at point, which the text names where the rays are not parallel.
void PaintScaleBar(double height_m, bool parallel, int floor_px, Picture* picture);

}  // namespace mbv::render
