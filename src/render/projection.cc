#include "render/projection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbv::render {
namespace {

// The whole picture's clip coordinates; rows of the view are right, up and backwards.
Eigen::Matrix4d Lens(const Camera& camera, double aspect, double near, double far) {
  const double t = std::tan(0.5 * kFieldOfView_deg * std::numbers::pi / 180.0);
  Eigen::Matrix4d lens = Eigen::Matrix4d::Zero();
  if (camera.parallel) {
    const double half = camera.distance_m * t;
    lens.diagonal() << 1.0 / (aspect * half), 1.0 / half, -2.0 / (far - near), 1.0;
    lens(2, 3) = -(far + near) / (far - near);
  } else {
    lens.diagonal() << 1.0 / (aspect * t), 1.0 / t, -(far + near) / (far - near), 0.0;
    lens(2, 3) = -2.0 * far * near / (far - near);
    lens(3, 2) = -1.0;
  }
  return lens;
}

}  // namespace

Projection ProjectionOf(const Camera& camera, int width, int height, const Tile& tile,
                        double extent_m, const Eigen::Vector2d& shift_px) {
  const CameraAxes axes = AxesOf(camera);
  Projection out{.eye_D = camera.position_D(), .forward_D = axes.forward};
  out.parallel = camera.parallel;
  out.shift_px = shift_px;
  const double far = camera.distance_m + 60.0 * extent_m;
  double near = camera.distance_m - 30.0 * extent_m;
  if (!camera.parallel) near = std::max(near, 0.05 * std::min(extent_m, camera.distance_m));
  Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
  view.block<3, 3>(0, 0) << axes.right.transpose(), axes.up.transpose(), -axes.forward.transpose();
  view.block<3, 1>(0, 3) = -view.block<3, 3>(0, 0) * out.eye_D;
  // The tile's part of the picture, as a scale and a shift.
  const double sx = static_cast<double>(width) / tile.width;
  const double sy = static_cast<double>(height) / tile.height;
  const double cx = (2.0 * tile.left + tile.width) / width - 1.0;
  const double cy = 1.0 - (2.0 * tile.top + tile.height) / height;
  Eigen::Matrix4d part = Eigen::Matrix4d::Identity();
  part(0, 0) = sx;
  part(1, 1) = sy;
  part(0, 3) = -sx * cx + 2.0 * shift_px.x() / tile.width;
  part(1, 3) = -sy * cy + 2.0 * shift_px.y() / tile.height;
  const double aspect = static_cast<double>(width) / height;
  out.clip_D = part * Lens(camera, aspect, near, far) * view;
  const double t = std::tan(0.5 * kFieldOfView_deg * std::numbers::pi / 180.0);
  out.rays_D << aspect * t / sx * axes.right, t / sy * axes.up,
      axes.forward + aspect * t * cx * axes.right + t * cy * axes.up;
  return out;
}

}  // namespace mbv::render
