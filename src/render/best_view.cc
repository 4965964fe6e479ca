#include "render/best_view.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "render/camera.h"

namespace mbv::render {
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
      if (item.framing == Framing::kNever) continue;
      Vec3 high = item.size;
      if (item.solid == Solid::kCapsule) high.z() += item.size.x();
      const bool glass = item.material.rgba[3] < 0.5F;
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
