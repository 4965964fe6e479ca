// A camera's picture as the graphics pipeline wants it, whole or one tile of it.
#pragma once

#include "core/types.h"
#include "render/camera.h"

namespace mbv::render {

/// Pixels [left, left + width) × [top, top + height) of a picture; they may lie beyond its edges.
struct Tile {
  int left = 0, top = 0, width = 1, height = 1;
};

struct Projection {
  Eigen::Matrix4d clip_D = Eigen::Matrix4d::Identity();  ///< D → clip coordinates of the tile
  Mat3 rays_D = Mat3::Identity();  ///< (x, y, 1) of the tile, -1 … 1 → direction of view
  Vec3 eye_D = Vec3::Zero(), forward_D = Vec3::UnitX();
  Eigen::Vector2d shift_px = Eigen::Vector2d::Zero();  ///< to the right and up
  bool parallel = false;
};

/// `extent_m` is the size of what is drawn; depth reaches some of it before and many of it behind
/// the look-at point. `shift_px` moves the picture to the right and up.
[[nodiscard]] Projection ProjectionOf(const Camera& camera, int width, int height, const Tile& tile,
                                      double extent_m, const Eigen::Vector2d& shift_px);

}  // namespace mbv::render
