#include "report/html_replay.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanism/joint_pose.h"
#include "mesh/decimate.h"
#include "report/html_text.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMaxFrames = 600;
constexpr size_t kMaxNumbers = 120000;   // of all poses: 0.64 MB as base64
constexpr size_t kMaxTriangles = 50000;  // of all meshes: 1.2 MB as base64

Json VectorJson(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

std::array<double, 7> PoseNumbers(const Pose& X) {
  const Eigen::Quaterniond q(X.linear());
  const Vec3 p = X.translation();
  return {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()};
}

bool AllFinite(const std::vector<Pose>& poses) {
  return std::all_of(poses.begin(), poses.end(),
                     [](const Pose& X) { return X.matrix().allFinite(); });
}

// Vertices, and triangles as their numbers: 32-bit floats hold these exactly.
Json SurfaceJson(const TriangleMesh& mesh) {
  std::vector<float> vertices, triangles;
  for (const Vec3& p : mesh.vertices) {
    for (int k = 0; k < 3; ++k) vertices.push_back(static_cast<float>(p[k]));
  }
  for (const auto& t : mesh.triangles) {
    for (const int corner : t) triangles.push_back(static_cast<float>(corner));
  }
  return {{"vertices", Base64(vertices)}, {"triangles", Base64(triangles)}};
}

Json ShapeJson(const Shape& shape, const DrawnSurfaces& surfaces) {
  struct Visitor {
    const DrawnSurfaces& surfaces;
    Json operator()(const Capsule& s) const {
      return {{"type", "capsule"},
              {"from", VectorJson(s.p_from)},
              {"to", VectorJson(s.p_to)},
              {"radius", s.radius}};
    }
    Json operator()(const Cylinder& s) const {
      return {{"type", "cylinder"},
              {"from", VectorJson(s.p_from)},
              {"to", VectorJson(s.p_to)},
              {"radius", s.radius}};
    }
    Json operator()(const Box& s) const {
      return {{"type", "box"}, {"pose", PoseNumbers(s.X_BG)}, {"size", VectorJson(s.size)}};
    }
    Json operator()(const Ball& s) const {
      return {{"type", "ball"}, {"at", VectorJson(s.p_centre)}, {"radius", s.radius}};
    }
    Json operator()(const Mesh& s) const {
      return {{"type", "mesh"}, {"pose", PoseNumbers(s.X_BG)}, {"surface", surfaces.IndexOf(s)}};
    }
  };
  Json json = std::visit(Visitor{surfaces}, shape.geometry);
  json["color"] = shape.color;
  return json;
}

class ReplayWriter {
 public:
  explicit ReplayWriter(const HtmlInput& input)
      : input_(input), mechanism_(*input.mechanism), surfaces_(mechanism_, kMaxTriangles) {
    ChooseFrames();
  }

  Json Write() const {
    Json json = {{"up", Up()},
                 {"time", Times()},
                 {"bodies", Bodies()},
                 {"drives", Drives()},
                 {"closures", Closures()},
                 {"springs", Springs()},
                 {"outputs", Outputs()},
                 {"simulated", !frames_.empty()}};
    Json paints = Json::object();
    for (const auto& [color, paint] : input_.paints) {
      paints[color] = {{"rgba", paint.rgba}, {"scenery", paint.scenery}};
    }
    json["paints"] = std::move(paints);
    if (!surfaces_.drawn().empty()) json["surfaces"] = Surfaces();
    return json;
  }

 private:
  // Every n-th sample up to the first that is not finite; none: the home pose.
  void ChooseFrames() {
    if (input_.X_WB == nullptr || input_.X_WB->empty()) return;
    size_t good = 0;
    // A run that broke down has no poses from there on.
    while (good < input_.X_WB->size() && (*input_.X_WB)[good].size() == mechanism_.bodies.size() &&
           AllFinite((*input_.X_WB)[good])) {
      ++good;
    }
    const size_t numbers = 7 * std::max<size_t>(1, mechanism_.bodies.size() - 1);
    const size_t most = std::clamp<size_t>(kMaxNumbers / numbers, 2, kMaxFrames);
    const size_t stride = good == 0 ? 1 : (good - 1) / most + 1;
    for (size_t i = 0; i < good; i += stride) frames_.push_back(i);
  }

  Json Surfaces() const {
    Json surfaces = Json::array();
    for (const auto& mesh : surfaces_.drawn()) surfaces.push_back(SurfaceJson(*mesh));
    return surfaces;
  }

  Json Up() const { return VectorJson(mechanism_.up_W); }

  Json Times() const {
    Json times = Json::array();
    for (const WitnessRecord& record : input_.report->witnesses) {
      if (record.name != role::kSimulated || record.trace.time_s.empty()) continue;
      for (const size_t i : frames_) times.push_back(record.trace.time_s[i]);
    }
    if (times.empty()) times.push_back(0.0);
    return times;
  }

  Json Bodies() const {
    Json bodies = Json::array();
    for (size_t b = 0; b < mechanism_.bodies.size(); ++b) {
      Json shapes = Json::array();
      for (const Shape& shape : mechanism_.bodies[b].shapes) {
        shapes.push_back(ShapeJson(shape, surfaces_));
      }
      if (shapes.empty() && b > 0) shapes = Rods(static_cast<int>(b));
      Json json = {{"name", mechanism_.bodies[b].name}, {"shapes", std::move(shapes)}};
      json["poses"] = Poses(b);
      bodies.push_back(std::move(json));
    }
    return bodies;
  }

  // A body without shapes: rods from its first joint to the others.
  Json Rods(int body) const {
    std::vector<Vec3> points;
    for (const Joint& joint : mechanism_.joints) {
      if (joint.parent == body) points.push_back(joint.X_PF.translation());
      if (joint.child == body) points.push_back(joint.X_CM.translation());
    }
    Json rods = Json::array();
    for (size_t i = 1; i < points.size(); ++i) {
      const double length = (points[i] - points[0]).norm();
      if (length < 1e-9) continue;
      rods.push_back(ShapeJson({Capsule{points[0], points[i], 0.03 * length}, "grey"}, surfaces_));
    }
    return rods;
  }

  // Seven numbers for a body at rest, else all frames as base64.
  Json Poses(size_t body) const {
    if (frames_.empty()) {
      const bool known = body < mechanism_.X_WB_home.size();
      return PoseNumbers(known ? mechanism_.X_WB_home[body] : Pose::Identity());
    }
    std::vector<float> numbers;
    std::array<double, 7> first{};
    double moved = 0.0;
    Eigen::Vector4d last_q = Eigen::Vector4d::Zero();
    for (const size_t i : frames_) {
      std::array<double, 7> pose = PoseNumbers((*input_.X_WB)[i][body]);
      // Neighbours lie in the same half of the quaternions, so that they can be interpolated.
      Eigen::Map<Eigen::Vector4d> q(pose.data() + 3);
      if (q.dot(last_q) < 0.0) q = -q;
      last_q = q;
      if (numbers.empty()) first = pose;
      for (size_t k = 0; k < 7; ++k) {
        moved = std::max(moved, std::abs(pose[k] - first[k]));
        numbers.push_back(static_cast<float>(pose[k]));
      }
    }
    if (moved < 1e-9) return first;
    return Base64(numbers);
  }

  Json Drives() const {
    Json drives = Json::array();
    for (const Drive& drive : mechanism_.drives) {
      if (const auto* distance = std::get_if<DistanceDrive>(&drive.kind)) {
        drives.push_back({{"type", "distance"},
                          {"from", distance->body_from},
                          {"p_from", VectorJson(distance->p_from)},
                          {"to", distance->body_to},
                          {"p_to", VectorJson(distance->p_to)},
                          {"radius", drive.radius}});
      } else {
        drives.push_back(JointDriveJson(std::get<JointDrive>(drive.kind)));
      }
    }
    return drives;
  }

  Json JointDriveJson(const JointDrive& drive) const {
    const Joint& joint = mechanism_.joints[static_cast<size_t>(drive.joint)];
    const bool second = joint.kind == JointKind::kUniversal && drive.coordinate == 1;
    const bool slides = IsLength(joint.kind, drive.coordinate);
    const Vec6 twist = UnitTwists(joint, Mat3::Identity(), Mat3::Identity()).col(drive.coordinate);
    const Vec3 axis = slides ? twist.tail<3>() : twist.head<3>();
    const Pose& X = second ? joint.X_CM : joint.X_PF;
    return {{"type", slides ? "slide" : "turn"},
            {"body", second ? joint.child : joint.parent},
            {"p", VectorJson(X.translation())},
            {"axis", VectorJson(X.linear() * axis)},
            {"child", joint.child},
            {"p_child", VectorJson(joint.X_CM.translation())}};
  }

  Json Closures() const {
    Json closures = Json::array();
    for (size_t j = 0; j < mechanism_.joints.size(); ++j) {
      const std::vector<int>& tree = mechanism_.tree_joints;
      const Joint& joint = mechanism_.joints[j];
      if (std::find(tree.begin(), tree.end(), static_cast<int>(j)) != tree.end()) continue;
      closures.push_back({{"name", joint.name},
                          {"parent", joint.parent},
                          {"p_parent", VectorJson(joint.X_PF.translation())},
                          {"child", joint.child},
                          {"p_child", VectorJson(joint.X_CM.translation())}});
    }
    return closures;
  }

  Json Springs() const {
    Json springs = Json::array();
    for (const SpringDamper& spring : mechanism_.springs) {
      springs.push_back({{"name", spring.name},
                         {"from", spring.body_from},
                         {"p_from", VectorJson(spring.p_from)},
                         {"to", spring.body_to},
                         {"p_to", VectorJson(spring.p_to)}});
    }
    return springs;
  }

  Json Outputs() const {
    Json outputs = Json::array();
    for (const Output& output : mechanism_.outputs) {
      outputs.push_back({{"name", output.name},
                         {"body", output.body},
                         {"pose", PoseNumbers(output.X_BO)},
                         {"in_world", output.reference_body == 0}});
    }
    return outputs;
  }

  const HtmlInput& input_;
  const Mechanism& mechanism_;
  const DrawnSurfaces surfaces_;
  std::vector<size_t> frames_;
};

}  // namespace

Json ReplayJson(const HtmlInput& input) { return ReplayWriter(input).Write(); }

}  // namespace mbv
