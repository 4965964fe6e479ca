// Where the camera stands. Everything here is in the drawing frame D (z up, same origin as W).
#pragma once

#include <limits>
#include <vector>

#include "base/types.h"
#include "mechanism/mechanism.h"
#include "render/render.h"
#include "render/scene.h"

namespace mbv::render {

/// Vertical field of view [deg]; small, so that parallel edges stay nearly parallel.
inline constexpr double kFieldOfView_deg = 26.0;

/// The default direction of view [deg].
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

// A camera's picture as the graphics pipeline wants it, whole or one tile of it.

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

// From where most of a mechanism is seen.

/// Share of the mechanism's joints and drive ends (0 … 1, over all frames) that no solid hides from
/// a far camera in the direction `to_camera_W`.
[[nodiscard]] double VisibleShare(const Mechanism& mechanism,
                                  const std::vector<PictureFrame>& frames, const Scale& scale,
                                  const PictureOptions& options, const Vec3& to_camera_W);

/// The options' view with the azimuth and elevation that it leaves open: azimuth -60° and elevation
/// 16° unless clearly more is seen from elsewhere.
[[nodiscard]] CameraView BestView(const Mechanism& mechanism,
                                  const std::vector<PictureFrame>& frames, const Scale& scale,
                                  const PictureOptions& options, const Mat3& R_DW);

}  // namespace mbv::render
