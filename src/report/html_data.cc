// The 3D replay of report.html: shapes and poses as data.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/markup.h"
#include "comparison/metrics.h"
#include "mechanism/joint_pose.h"
#include "model_file/mesh/decimate.h"
#include "report/html_report.h"
#include "report/page.h"

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

// Bodies with shapes and poses (at most 600 frames; fewer when there are many bodies), drives,
// loop closures, springs and outputs; meshes decimated to 50 000 triangles together. Positions in
// metres, rotations as quaternions x, y, z, w.
Json ReplayJson(const HtmlInput& input) { return ReplayWriter(input).Write(); }

namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kMaxSamples = 2400;  // per plotted signal

// The witnesses' signals on one time grid, thinned out for plotting.
class Signals {
 public:
  explicit Signals(const Report& report) : report_(report) {
    for (const WitnessRecord& record : report.witnesses) {
      if (record.trace.time_s.size() > (grid_ ? grid_->time_s.size() : 0)) grid_ = &record.trace;
    }
    if (grid_ != nullptr) stride_ = (grid_->time_s.size() - 1) / kMaxSamples + 1;
  }

  [[nodiscard]] bool empty() const { return grid_ == nullptr; }

  [[nodiscard]] Json Times() const {
    Json times = Json::array();
    for (size_t i = 0; i < grid_->time_s.size(); i += stride_) times.push_back(grid_->time_s[i]);
    return times;
  }

  // A channel on the grid; empty when the witness has none.
  [[nodiscard]] std::vector<double> Full(const Trace& trace, const std::string& channel) const {
    const int column = trace.Find(channel);
    if (column < 0) return {};
    std::vector<double> values(grid_->time_s.size(), kNan);
    for (const auto& [a, b] : AlignSamples(*grid_, trace)) {
      values[static_cast<size_t>(a)] = trace.values(b, column);
    }
    return values;
  }

  [[nodiscard]] Json Plain(const Trace& trace, const std::string& channel) const {
    const std::vector<double> values = Full(trace, channel);
    if (values.empty()) return {};
    std::vector<float> thin;
    for (size_t i = 0; i < values.size(); i += stride_) {
      thin.push_back(static_cast<float>(values[i]));
    }
    return Base64(thin);
  }

  // |a − b| · scale; where samples are left out, the largest of them is kept.
  [[nodiscard]] Json Error(const std::vector<double>& a, const std::vector<double>& b,
                           double scale) const {
    if (a.empty() || b.empty()) return {};
    std::vector<float> thin;
    for (size_t i = 0; i < a.size(); i += stride_) {
      double worst = kNan;
      for (size_t k = i; k < std::min(i + stride_, a.size()); ++k) {
        worst = std::fmax(worst, std::abs(a[k] - b[k]) * scale);
      }
      thin.push_back(static_cast<float>(worst));
    }
    return Base64(thin);
  }

  [[nodiscard]] const Trace* TraceOf(const std::string& witness) const {
    for (const WitnessRecord& record : report_.witnesses) {
      if (record.name == witness && !record.trace.time_s.empty()) return &record.trace;
    }
    return nullptr;
  }

 private:
  const Report& report_;
  const Trace* grid_ = nullptr;
  size_t stride_ = 1;
};

double Largest(const std::vector<double>& values) {
  double largest = 0.0;
  for (const double value : values) largest = std::fmax(largest, std::abs(value));
  return largest;
}

Json Finite(double value) { return std::isfinite(value) ? Json(value) : Json(); }

class DataWriter {
 public:
  explicit DataWriter(const HtmlInput& input)
      : input_(input), report_(*input.report), mechanism_(*input.mechanism), signals_(report_) {}

  std::string Write() {
    Json json = {{"schema", "mbverify.page/1"},
                 {"title", report_.mechanism + " / " + report_.scenario},
                 {"verdict", ToText(report_.comparison.verdict)}};
    json["drives"] = Drives();
    if (!signals_.empty()) {
      json["time"] = signals_.Times();
      json["witnesses"] = Witnesses();
      json["pairs"] = Pairs();
    }
    json["replay"] = ReplayJson(input_);
    return EscapeScript(DumpLine(json));
  }

 private:
  Json Drives() const {
    Json drives = Json::array();
    for (const Drive& drive : mechanism_.drives) {
      drives.push_back({{"name", drive.name},
                        {"unit", ForceUnit(mechanism_, drive)},
                        {"position_unit", PositionUnit(mechanism_, drive)}});
    }
    return drives;
  }

  Json Witnesses() const {
    Json witnesses = Json::array();
    for (const WitnessRecord& record : report_.witnesses) {
      if (record.trace.time_s.empty()) continue;
      Json json = {{"name", record.name}};
      for (const auto& [key, quantity] :
           {std::pair{"force", Quantity::kForce}, std::pair{"position", Quantity::kPosition}}) {
        json[key] = Json::array();
        for (const Drive& drive : mechanism_.drives) {
          json[key].push_back(signals_.Plain(record.trace, ChannelName(quantity, drive.name)));
        }
      }
      json["band"] = Json::array();
      for (const Drive& drive : mechanism_.drives) {
        json["band"].push_back(
            signals_.Plain(record.trace, ChannelName(Quantity::kForceBand, drive.name)));
      }
      json["outputs"] = Outputs(record.trace);
      AddAudit(record, &json);
      witnesses.push_back(std::move(json));
    }
    return witnesses;
  }

  Json Outputs(const Trace& trace) const {
    Json outputs = Json::array();
    for (const Output& output : mechanism_.outputs) {
      Json values = Json::array();
      for (int c = 0; c < 6; ++c) {
        values.push_back(signals_.Plain(trace, ChannelName(Quantity::kPose, output.name, c)));
      }
      const std::string& body = mechanism_.bodies[static_cast<size_t>(output.reference_body)].name;
      outputs.push_back({{"name", output.name}, {"frame", body}, {"values", std::move(values)}});
    }
    return outputs;
  }

  // Closure and power, with the limits they are judged by.
  void AddAudit(const WitnessRecord& record, Json* json) const {
    const std::string in = ChannelName(Quantity::kInputPower);
    const std::string out = ChannelName(Quantity::kEnergyRate);
    const std::vector<std::pair<const char*, std::string>> channels = {
        {"closure_m", ChannelName(Quantity::kLoopGap)},
        {"closure_rad", ChannelName(Quantity::kLoopTwist)},
        {"power_input", in},
        {"power_rate", out}};
    for (const auto& [key, channel] : channels) {
      (*json)[key] = signals_.Plain(record.trace, channel);
    }
    const std::vector<double> input = signals_.Full(record.trace, in);
    const std::vector<double> rate = signals_.Full(record.trace, out);
    const double largest = std::fmax(Largest(input), Largest(rate));
    (*json)["power_error"] = signals_.Error(input, rate, largest > 0.0 ? 1.0 / largest : 1.0);
    Json limits = Json::object();
    for (const CheckResult& check : report_.comparison.checks) {
      if (check.subject != record.name || !check.limit) continue;
      limits[RowOf(check.metric).key] = *check.limit;
    }
    (*json)["limits"] = std::move(limits);
  }

  // Force errors relative to the largest force of the drives of the same unit.
  Json Pairs() const {
    Json pairs = Json::array();
    for (const PairComparison& pair : report_.comparison.pairs) {
      const Trace* measured = signals_.TraceOf(pair.measured);
      const Trace* truth = signals_.TraceOf(pair.truth);
      if (measured == nullptr || truth == nullptr) continue;
      Json errors = Json::array(), scales = Json::array();
      for (const Drive& drive : mechanism_.drives) {
        const double largest = LargestForce(*truth, ForceUnit(mechanism_, drive));
        const std::string channel = ChannelName(Quantity::kForce, drive.name);
        scales.push_back(largest);
        errors.push_back(signals_.Error(signals_.Full(*measured, channel),
                                        signals_.Full(*truth, channel),
                                        largest > 0.0 ? 1.0 / largest : 1.0));
      }
      Json json = {{"name", pair.name()},
                   {"measured", pair.measured},
                   {"truth", pair.truth},
                   {"error", std::move(errors)},
                   {"scale", std::move(scales)}};
      AddWorst(pair, &json);
      pairs.push_back(std::move(json));
    }
    return pairs;
  }

  double LargestForce(const Trace& truth, const std::string& unit) const {
    double largest = 0.0;
    for (const Drive& drive : mechanism_.drives) {
      if (ForceUnit(mechanism_, drive) != unit) continue;
      const std::string channel = ChannelName(Quantity::kForce, drive.name);
      largest = std::fmax(largest, Largest(signals_.Full(truth, channel)));
    }
    return largest;
  }

  void AddWorst(const PairComparison& pair, Json* json) const {
    const CheckResult* check = report_.comparison.FindCheck(pair.name() + ".force_max");
    if (check == nullptr) return;
    if (check->limit) (*json)["limit"] = *check->limit;
    for (size_t i = 0; i < mechanism_.drives.size(); ++i) {
      if (ChannelName(Quantity::kForce, mechanism_.drives[i].name) != check->channel) continue;
      (*json)["worst"] = {
          {"drive", i}, {"time", Finite(check->time_s)}, {"value", Finite(check->value)}};
    }
  }

  const HtmlInput& input_;
  const Report& report_;
  const Mechanism& mechanism_;
  const Signals signals_;
};

}  // namespace

std::string PageData(const HtmlInput& input) { return DataWriter(input).Write(); }

}  // namespace mbv
