// Where the camera stands. Everything here is in the drawing frame D (z up, same origin as W).
#pragma once

#include <vector>

#include "core/types.h"
#include "render/render.h"

namespace mbv::render {

/// Vertical field of view [deg]; small, so that parallel edges stay nearly parallel.
inline constexpr double kFieldOfView_deg = 26.0;

struct Camera {
  double azimuth_deg = 0.0, elevation_deg = 0.0;  ///< as in CameraView
  double distance_m = 1.0;
  Vec3 lookat_D = Vec3::Zero();

  [[nodiscard]] Vec3 forward_D() const;  ///< unit, from the camera to the look-at point
  [[nodiscard]] Vec3 position_D() const { return lookat_D - distance_m * forward_D(); }
};

/// Part of the picture that the mechanism may fill, as fractions of width and height.
struct Margins {
  double side = 0.05, top = 0.05, bottom = 0.05;
};

/// The nearest camera of the view's direction (default: azimuth -60°, elevation 16°) from which
/// all points lie inside the margins; the view's own distance and look-at point take precedence.
/// `aspect` is width over height. Needs at least one point.
[[nodiscard]] Camera FitCamera(const std::vector<Vec3>& points_D, const CameraView& view,
                               double aspect, const Margins& margins, const Mat3& R_DW);

/// Picture coordinates (0 … 1 from the left and from the top) of a point before the camera.
[[nodiscard]] Eigen::Vector2d Project(const Camera& camera, double aspect, const Vec3& p_D);

}  // namespace mbv::render
