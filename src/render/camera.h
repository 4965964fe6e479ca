// Where the camera stands. Everything here is in the drawing frame D (z up, same origin as W).
#pragma once

#include <limits>

#include "core/types.h"
#include "render/render.h"

namespace mbv::render {

/// Vertical field of view [deg]; small, so that parallel edges stay nearly parallel.
inline constexpr double kFieldOfView_deg = 26.0;

/// From where is looked unless told otherwise [deg].
inline constexpr double kUsualAzimuth_deg = -60.0, kUsualElevation_deg = 16.0;

struct Camera {
  double azimuth_deg = 0.0, elevation_deg = 0.0;  ///< as in CameraView
  double distance_m = 1.0;
  Vec3 lookat_D = Vec3::Zero();
  bool parallel = false;  ///< orthographic: all as large as in the plane through the look-at point

  [[nodiscard]] Vec3 forward_D() const;  ///< unit, from the camera to the look-at point
  [[nodiscard]] Vec3 position_D() const { return lookat_D - distance_m * forward_D(); }
};

/// Unit vectors of the picture: to the right, upwards, away from the camera.
struct CameraAxes {
  Vec3 right, up, forward;
};
[[nodiscard]] CameraAxes AxesOf(const Camera& camera);

/// Part of the picture that the mechanism may fill, as fractions of width and height.
struct Margins {
  double side = 0.05, top = 0.05, bottom = 0.05;
};

/// Fits a camera of the view's direction (default: azimuth -60°, elevation 16°) to points that are
/// given one by one: the nearest one from which all lie inside the margins. The view's own distance
/// and look-at point take precedence.
class CameraFit {
 public:
  /// `aspect` is width over height.
  CameraFit(const CameraView& view, double aspect, const Margins& margins, const Mat3& R_DW);
  void Include(const Vec3& p_D);
  /// Needs at least one point.
  [[nodiscard]] Camera Fit() const;

 private:
  // One picture direction: right or up.
  struct Side {
    double t_plus = 1.0, t_minus = 1.0;  // tangents of the angles that the margins leave
    double plus = -std::numeric_limits<double>::infinity();
    double minus = -std::numeric_limits<double>::infinity();

    void Include(double a, double z);
    [[nodiscard]] double nearest() const;
    [[nodiscard]] double middle(double cz) const;
  };

  CameraView view_;
  Camera camera_;
  Side across_, along_;
  Eigen::AlignedBox3d box_;
  double distance_to_lookat_ = 0.0;  // that a given look-at point needs
};

/// What the picture's height shows of the plane through the look-at point [m].
[[nodiscard]] double HeightAtLookat(const Camera& camera);

/// Picture coordinates (0 … 1 from the left and from the top) of a point before the camera.
[[nodiscard]] Eigen::Vector2d Project(const Camera& camera, double aspect, const Vec3& p_D);

}  // namespace mbv::render
