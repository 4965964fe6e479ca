#include "render/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/demand.h"

namespace mbv::render {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

struct Axes {
  Vec3 right, up, forward;
};

Axes AxesOf(const Camera& camera) {
  const double a = camera.azimuth_deg * kRadPerDeg, e = camera.elevation_deg * kRadPerDeg;
  return {.right = Vec3(-std::sin(a), std::cos(a), 0.0),
          .up = Vec3(-std::sin(e) * std::cos(a), -std::sin(e) * std::sin(a), std::cos(e)),
          .forward = -Vec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e))};
}

// In one picture direction, a camera at (c, depth cz) sees the point (a, z) inside the margins if
// a - c <= t_plus (z - cz) and -(a - c) <= t_minus (z - cz). Over all points:
// c - t_plus cz >= plus and -c - t_minus cz >= minus.
struct Side {
  double t_plus = 1.0, t_minus = 1.0;
  double plus = -std::numeric_limits<double>::infinity();
  double minus = -std::numeric_limits<double>::infinity();

  void Include(double a, double z) {
    plus = std::max(plus, a - t_plus * z);
    minus = std::max(minus, -a - t_minus * z);
  }
  [[nodiscard]] double nearest() const { return -(plus + minus) / (t_plus + t_minus); }
  // Middle of what is allowed at the depth cz.
  [[nodiscard]] double middle(double cz) const {
    return 0.5 * ((plus + t_plus * cz) - (minus + t_minus * cz));
  }
};

}  // namespace

Vec3 Camera::forward_D() const { return AxesOf(*this).forward; }

Camera FitCamera(const std::vector<Vec3>& points_D, const CameraView& view, double aspect,
                 const Margins& margins, const Mat3& R_DW) {
  MBV_DEMAND(!points_D.empty(), points_D.size());
  Camera camera;
  camera.azimuth_deg = view.azimuth_deg.value_or(-60.0);
  camera.elevation_deg = view.elevation_deg.value_or(16.0);
  const auto [right, up, forward] = AxesOf(camera);
  const double t = std::tan(0.5 * kFieldOfView_deg * kRadPerDeg);
  Side across{.t_plus = aspect * t * (1.0 - 2.0 * margins.side),
              .t_minus = aspect * t * (1.0 - 2.0 * margins.side)};
  Side along{.t_plus = t * (1.0 - 2.0 * margins.top), .t_minus = t * (1.0 - 2.0 * margins.bottom)};
  Vec3 centre = Vec3::Zero();
  for (const Vec3& p : points_D) {
    across.Include(p.dot(right), p.dot(forward));
    along.Include(p.dot(up), p.dot(forward));
    centre += p / static_cast<double>(points_D.size());
  }
  const double cz = std::min(across.nearest(), along.nearest());
  const Vec3 position = across.middle(cz) * right + along.middle(cz) * up + cz * forward;
  camera.distance_m = std::max((centre - position).dot(forward), 1e-6);
  if (view.lookat_W) {
    // Looking elsewhere: far enough that everything still fits.
    camera.lookat_D = R_DW * *view.lookat_W;
    double distance = 0.0;
    for (const Vec3& p_D : points_D) {
      const Vec3 p = p_D - camera.lookat_D;
      const double x = p.dot(right), y = p.dot(up), z = p.dot(forward);
      const double needed =
          std::max({x / across.t_plus, -x / across.t_minus, y / along.t_plus, -y / along.t_minus});
      distance = std::max(distance, needed - z);
    }
    camera.distance_m = std::max(distance, 1e-6);
  } else {
    camera.lookat_D = position + camera.distance_m * forward;
  }
  if (view.distance_m) camera.distance_m = *view.distance_m;
  return camera;
}

Eigen::Vector2d Project(const Camera& camera, double aspect, const Vec3& p_D) {
  const auto [right, up, forward] = AxesOf(camera);
  const Vec3 p = p_D - camera.position_D();
  const double t = std::tan(0.5 * kFieldOfView_deg * kRadPerDeg), z = p.dot(forward);
  return {0.5 + 0.5 * p.dot(right) / (z * t * aspect), 0.5 - 0.5 * p.dot(up) / (z * t)};
}

}  // namespace mbv::render
