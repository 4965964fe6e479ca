#include "render/camera.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/demand.h"

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

namespace {

constexpr std::size_t kMostPoints = 48, kMostFrames = 3;
// What a view has to show more to be preferred: a half turn, and looking from 24° higher.
constexpr double kVeil = 0.35;  // what glass takes from what is seen through it
constexpr double kTurnCost = 0.12, kHeightCost = 0.10;
// A view along the plane of a planar mechanism shows nothing of its shape: what each missing tenth
// of the breadth below this share of the broadest view costs is half of a tenth.
constexpr double kBroad = 0.7, kNarrowCost = 0.5;

// Shares of the next larger extent, squared: below, points lie on a line, or in a plane.
constexpr double kOnALine = 1e-4, kInAPlane = 2.5e-3;

// Of a symmetric matrix: S adj(S) = det(S) 1.
Mat3 Adjugate(const Mat3& S) {
  Mat3 adjugate;
  adjugate << S.col(1).cross(S.col(2)), S.col(2).cross(S.col(0)), S.col(0).cross(S.col(1));
  return adjugate;
}

// A solid as a box in its own frame.
struct Blocker {
  Pose X_GW;
  Vec3 low, high;
  double share = 1.0;  ///< of what is behind it that it hides: glass veils

  // Whether a ray from p meets it further away than `near`.
  [[nodiscard]] bool Hides(const Vec3& p_W, const Vec3& direction_W, double near) const {
    const Vec3 p = X_GW * p_W, d = X_GW.linear() * direction_W;
    double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
    for (int i = 0; i < 3; ++i) {
      if (std::abs(d[i]) < 1e-12) {
        if (p[i] < low[i] || p[i] > high[i]) return false;
        continue;
      }
      const double a = (low[i] - p[i]) / d[i], b = (high[i] - p[i]) / d[i];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    return enter <= leave && enter > near;
  }
};

// What hides and what is to be seen, of some of the frames.
class Sight {
 public:
  Sight(const Mechanism& mechanism, const std::vector<PictureFrame>& frames, const Scale& scale,
        const PictureOptions& options)
      : near_(3.0 * scale.joint_m) {
    const std::size_t count = std::min(frames.size(), kMostFrames);
    for (std::size_t k = 0; k < count; ++k) {
      const PictureFrame& frame = frames[count < 2 ? 0 : k * (frames.size() - 1) / (count - 1)];
      AddFrame(mechanism, frame, scale, options);
    }
  }

  // How much of the broadest view's area the points of a planar mechanism span in this one; 1 for
  // others, and for points on a line.
  [[nodiscard]] double Breadth(const Vec3& to_camera_W) const {
    double seen = 0.0, all = 0.0;
    for (const Scene& scene : scenes_) {
      // The spread S seen along u has the determinant uᵀ adj(S) u.
      seen += std::sqrt(std::max(0.0, to_camera_W.dot(scene.adjugate * to_camera_W)));
      all += scene.broadest;
    }
    return all == 0.0 ? 1.0 : seen / all;
  }

  [[nodiscard]] double Share(const Vec3& to_camera_W) const {
    double seen = 0.0, all = 0.0;
    for (const Scene& scene : scenes_) {
      for (const Vec3& p : scene.points) {
        all += 1.0;
        double left = 1.0;
        for (const Blocker& blocker : scene.blockers) {
          if (left > 0.0 && blocker.Hides(p, to_camera_W, near_)) left *= 1.0 - blocker.share;
        }
        seen += left;
      }
    }
    return all == 0.0 ? 1.0 : seen / all;
  }

 private:
  struct Scene {
    std::vector<Blocker> blockers;
    std::vector<Vec3> points;
    Mat3 adjugate = Mat3::Zero();  // of the spread of points in a plane
    double broadest = 0.0;         // its area; 0: they are in none
  };

  void AddFrame(const Mechanism& mechanism, const PictureFrame& frame, const Scale& scale,
                const PictureOptions& options) {
    Scene scene;
    PictureOptions plain = options;
    plain.output_frames = false;
    for (const Item& item : MechanismItems(mechanism, frame, scale, plain)) {
      const bool glass = item.material.rgba[3] < 0.5F;
      Vec3 high = item.size;
      if (item.solid == Solid::kCapsule) high.z() += item.size.x();
      scene.blockers.push_back(
          {.X_GW = item.X_WG.inverse(), .low = -high, .high = high, .share = glass ? kVeil : 1.0});
    }
    std::vector<Vec3> points;
    for (const Joint& joint : mechanism.joints) {
      if (joint.kind == JointKind::kFree || joint.kind == JointKind::kFixed) continue;
      points.emplace_back(frame.X_WB[joint.child] * Vec3(joint.X_CM.translation()));
    }
    for (const Drive& drive : mechanism.drives) {
      if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
        points.emplace_back(frame.X_WB[leg->body_from] * leg->p_from);
        points.emplace_back(frame.X_WB[leg->body_to] * leg->p_to);
      }
    }
    const std::size_t step = points.size() / kMostPoints + 1;
    for (std::size_t i = 0; i < points.size(); i += step) scene.points.push_back(points[i]);
    Measure(&scene);
    scenes_.push_back(std::move(scene));
  }

  static void Measure(Scene* scene) {
    Vec3 middle = Vec3::Zero();
    for (const Vec3& p : scene->points) middle += p / static_cast<double>(scene->points.size());
    Mat3 spread = Mat3::Zero();
    for (const Vec3& p : scene->points) spread += (p - middle) * (p - middle).transpose();
    const Vec3 sizes = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvalues();
    if (!(sizes[1] > kOnALine * sizes[2] && sizes[0] < kInAPlane * sizes[1])) return;
    scene->adjugate = Adjugate(spread);
    scene->broadest = std::sqrt(sizes[1] * sizes[2]);
  }

  double near_;  // what touches the point does not hide it
  std::vector<Scene> scenes_;
};

}  // namespace

double VisibleShare(const Mechanism& mechanism, const std::vector<PictureFrame>& frames,
                    const Scale& scale, const PictureOptions& options, const Vec3& to_camera_W) {
  return Sight(mechanism, frames, scale, options).Share(to_camera_W);
}

CameraView BestView(const Mechanism& mechanism, const std::vector<PictureFrame>& frames,
                    const Scale& scale, const PictureOptions& options, const Mat3& R_DW) {
  const Camera usual{.azimuth_deg = kUsualAzimuth_deg, .elevation_deg = kUsualElevation_deg};
  CameraView best = options.camera;
  if (!best.azimuth_deg) best.azimuth_deg = usual.azimuth_deg;
  if (!best.elevation_deg) best.elevation_deg = usual.elevation_deg;
  // A stated place to look at or distance belongs to the usual direction.
  if (options.camera.azimuth_deg || options.camera.lookat_W || options.camera.distance_m) {
    return best;
  }
  const Sight sight(mechanism, frames, scale, options);
  double best_score = -1.0;
  const std::vector<double> heights =
      options.camera.elevation_deg ? std::vector<double>{*options.camera.elevation_deg}
                                   : std::vector<double>{usual.elevation_deg, 24.0, 32.0, 40.0};
  for (const double height : heights) {
    for (int turn = 0; turn < 24; ++turn) {
      const double by = turn % 2 == 0 ? -7.5 * turn : 7.5 * (turn + 1);  // 0, 15, -15, 30 …
      Camera camera = usual;
      camera.azimuth_deg += by;
      camera.elevation_deg = height;
      const Vec3 to_camera_W = -(R_DW.transpose() * camera.forward_D());
      const double narrow = std::max(0.0, kBroad - sight.Breadth(to_camera_W));
      const double score = sight.Share(to_camera_W) - kNarrowCost * narrow -
                           kTurnCost * std::abs(by) / 180.0 -
                           kHeightCost * std::abs(height - heights.front()) / 24.0;
      if (score <= best_score) continue;
      best_score = score;
      best.azimuth_deg = camera.azimuth_deg;
      best.elevation_deg = height;
    }
  }
  return best;
}

}  // namespace mbv::render
