#include "render/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/demand.h"

namespace mbv::render {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

}  // namespace

CameraAxes AxesOf(const Camera& camera) {
  const double a = camera.azimuth_deg * kRadPerDeg, e = camera.elevation_deg * kRadPerDeg;
  return {.right = Vec3(-std::sin(a), std::cos(a), 0.0),
          .up = Vec3(-std::sin(e) * std::cos(a), -std::sin(e) * std::sin(a), std::cos(e)),
          .forward = -Vec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e))};
}

Vec3 Camera::forward_D() const { return AxesOf(*this).forward; }

// A camera at c and depth cz sees the point (a, z) inside the margins if a - c <= t_plus (z - cz)
// and -(a - c) <= t_minus (z - cz). Over all points: c - t_plus cz >= plus, -c - t_minus cz >=
// minus.
void CameraFit::Side::Include(double a, double z) {
  plus = std::max(plus, a - t_plus * z);
  minus = std::max(minus, -a - t_minus * z);
}

double CameraFit::Side::nearest() const { return -(plus + minus) / (t_plus + t_minus); }

// Middle of what is allowed at the depth cz.
double CameraFit::Side::middle(double cz) const {
  return 0.5 * ((plus + t_plus * cz) - (minus + t_minus * cz));
}

CameraFit::CameraFit(const CameraView& view, double aspect, const Margins& margins,
                     const Mat3& R_DW)
    : view_(view) {
  camera_.azimuth_deg = view.azimuth_deg.value_or(kUsualAzimuth_deg);
  camera_.elevation_deg = view.elevation_deg.value_or(kUsualElevation_deg);
  camera_.parallel = view.orthographic;
  if (view.lookat_W) camera_.lookat_D = R_DW * *view.lookat_W;
  const double t = std::tan(0.5 * kFieldOfView_deg * kRadPerDeg);
  across_.t_plus = across_.t_minus = aspect * t * (1.0 - 2.0 * margins.side);
  along_.t_plus = t * (1.0 - 2.0 * margins.top);
  along_.t_minus = t * (1.0 - 2.0 * margins.bottom);
}

void CameraFit::Include(const Vec3& p_D) {
  const auto [right, up, forward] = AxesOf(camera_);
  // Parallel rays show all as if it lay in one plane.
  const double z = camera_.parallel ? 0.0 : p_D.dot(forward);
  across_.Include(p_D.dot(right), z);
  along_.Include(p_D.dot(up), z);
  box_.extend(p_D);
  const Vec3 p = p_D - camera_.lookat_D;
  const double x = p.dot(right), y = p.dot(up);
  const double needed =
      std::max({x / across_.t_plus, -x / across_.t_minus, y / along_.t_plus, -y / along_.t_minus});
  distance_to_lookat_ =
      std::max(distance_to_lookat_, camera_.parallel ? needed : needed - p.dot(forward));
}

Camera CameraFit::Fit() const {
  MBV_DEMAND(!box_.isEmpty(), "a camera fitted to no points");
  const auto [right, up, forward] = AxesOf(camera_);
  Camera camera = camera_;
  if (view_.lookat_W) {
    camera.distance_m = std::max(distance_to_lookat_, 1e-6);
  } else {
    const double cz = std::min(across_.nearest(), along_.nearest());
    const Vec3 aside = across_.middle(cz) * right + along_.middle(cz) * up;
    const double depth = box_.center().dot(forward);
    camera.distance_m = std::max(camera.parallel ? -cz : depth - cz, 1e-6);
    camera.lookat_D = aside + depth * forward;
  }
  if (view_.distance_m) camera.distance_m = *view_.distance_m;
  return camera;
}

double HeightAtLookat(const Camera& camera) {
  return 2.0 * camera.distance_m * std::tan(0.5 * kFieldOfView_deg * kRadPerDeg);
}

Eigen::Vector2d Project(const Camera& camera, double aspect, const Vec3& p_D) {
  const auto [right, up, forward] = AxesOf(camera);
  const Vec3 p = p_D - camera.position_D();
  const double z = camera.parallel ? camera.distance_m : p.dot(forward);
  const double height = HeightAtLookat(camera) * z / camera.distance_m;
  return {0.5 + p.dot(right) / (height * aspect), 0.5 - p.dot(up) / height};
}

}  // namespace mbv::render
