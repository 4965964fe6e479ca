#include "model_file/urdf_frame_links.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/spatial.h"
#include "core/text.h"

namespace mbv::internal {
namespace {

void AddMass(const Body& part, const Pose& X_BP, Body* body) {
  if (part.mass == 0.0 && part.I_Bcm_B.isZero(0.0)) return;
  const double mass = body->mass + part.mass;
  const Vec3 p_part = X_BP * part.p_BoBcm_B;
  Vec3 p = 0.5 * (body->p_BoBcm_B + p_part);
  if (mass > 0.0) p = (body->mass * body->p_BoBcm_B + part.mass * p_part) / mass;
  // Steiner's terms of both about the new centre of mass.
  const Mat3 C_body = Skew(body->p_BoBcm_B - p), C_part = Skew(p_part - p);
  body->I_Bcm_B += X_BP.linear() * part.I_Bcm_B * X_BP.linear().transpose() -
                   body->mass * C_body * C_body - part.mass * C_part * C_part;
  body->mass = mass;
  body->p_BoBcm_B = p;
}

struct MoveShape {
  Pose X;
  void operator()(Capsule& shape) const { MoveEnds(&shape.p_from, &shape.p_to); }
  void operator()(Cylinder& shape) const { MoveEnds(&shape.p_from, &shape.p_to); }
  void operator()(Box& shape) const { shape.X_BG = X * shape.X_BG; }
  void operator()(Ball& shape) const { shape.p_centre = X * shape.p_centre; }
  void operator()(Mesh& shape) const { shape.X_BG = X * shape.X_BG; }
  void MoveEnds(Vec3* from, Vec3* to) const {
    *from = X * *from;
    *to = X * *to;
  }
};

class Folder {
 public:
  Folder(const std::set<std::string>& keep, const std::vector<std::string>& motors, UrdfTree* tree)
      : keep_(keep), motors_(motors), tree_(*tree) {
    for (const Body& body : tree_.bodies) total_kg_ += body.mass;
    const size_t n = tree_.bodies.size();
    carrier_.resize(n);
    X_CL_.assign(n, Pose::Identity());
    joint_of_.assign(n, -1);
    for (size_t b = 0; b < n; ++b) carrier_[b] = static_cast<int>(b);
    for (size_t j = 0; j < tree_.joints.size(); ++j) {
      const Joint& joint = tree_.joints[j];
      if (!joint.closure && joint.child >= 0) joint_of_[joint.child] = static_cast<int>(j);
    }
  }

  void Run() {
    // Leaves first: a piece becomes an end only when all that hung on it went over to it.
    for (size_t b = tree_.bodies.size(); b-- > 0;) FreezeLooseEnd(static_cast<int>(b));
    // Parents come first, so that a chain of frames ends on its carrier.
    for (size_t b = 0; b < tree_.bodies.size(); ++b) {
      if (IsFrame(static_cast<int>(b))) Join(static_cast<int>(b));
    }
    for (size_t b = 0; b < tree_.bodies.size(); ++b) {
      if (carrier_[b] == static_cast<int>(b)) MakeMassless(static_cast<int>(b));
    }
    Retarget();
    Compact();
  }

  void Report(const std::string& file, Diagnostics* diagnostics) const {
    if (joined_.empty() && massless_.empty()) return;
    std::vector<std::string> parts;
    if (!joined_.empty()) {
      std::string text =
          fmt::format("{} link{} {} taken as frames of the bodies that carry them ({})",
                      joined_.size(), joined_.size() == 1 ? "" : "s",
                      joined_.size() == 1 ? "is" : "are", Joined(joined_, kMost));
      if (joined_kg_ > 0.0) {
        text += fmt::format(", their {:.3g} kg went to {}", joined_kg_, Joined(heavier_, kMost));
      }
      parts.push_back(text);
    }
    if (!points_.empty()) {
      parts.push_back(fmt::format("of these {} without inertia, taken as mass point{}: {}",
                                  points_.size(), points_.size() == 1 ? "" : "s",
                                  Joined(points_, kMost)));
    }
    if (!frozen_.empty()) {
      parts.push_back(fmt::format("the joints {} move nothing of mass and are held at zero",
                                  Joined(frozen_, kMost)));
    }
    if (!massless_.empty()) {
      parts.push_back(fmt::format(
          "{} link{} of together {:.3g} kg without inertia {} taken as massless connecting "
          "piece{} ({})",
          massless_.size(), massless_.size() == 1 ? "" : "s", massless_kg_,
          massless_.size() == 1 ? "is" : "are", massless_.size() == 1 ? "" : "s",
          Joined(massless_, kMost)));
    }
    Finding finding{.severity = Severity::kWarning, .file = file, .message = {}, .hint = {}};
    for (const std::string& part : parts) {
      finding.message += (finding.message.empty() ? "" : "; ") + part;
    }
    diagnostics->Add(finding);
  }

 private:
  static constexpr size_t kMost = 4;  // names in a message

  [[nodiscard]] bool HasInertia(const Body& body) const { return !body.I_Bcm_B.isZero(0.0); }
  [[nodiscard]] bool IsNegligible(const Body& body) const {
    return body.mass <= kNegligibleShare * total_kg_;
  }

  [[nodiscard]] bool IsFrame(int b) const {
    const Body& body = tree_.bodies[b];
    if (joint_of_[b] < 0 || keep_.count(body.name) > 0) return false;
    if (tree_.joints[joint_of_[b]].kind != JointKind::kFixed) return false;
    if (IsNegligible(body)) return true;
    return !HasInertia(body) && body.mass <= kPointMassShare * total_kg_;
  }

  // What a joint or closure holds on to: the link itself, or frames on it.
  [[nodiscard]] bool IsLoose(int b) const {
    for (size_t j = 0; j < tree_.joints.size(); ++j) {
      const Joint& joint = tree_.joints[j];
      if (joint.parent != b && !(joint.closure && joint.child == b)) continue;
      if (joint.closure) return false;
      if (!IsFrame(joint.child) || !IsLoose(joint.child)) return false;
    }
    return true;
  }

  void FreezeLooseEnd(int b) {
    const Body& body = tree_.bodies[b];
    if (joint_of_[b] < 0 || body.mass == 0.0 || HasInertia(body) || !IsNegligible(body)) return;
    Joint& joint = tree_.joints[joint_of_[b]];
    if (joint.kind == JointKind::kFixed || Contains(motors_, joint.name)) return;
    if (keep_.count(body.name) > 0 || !IsLoose(b)) return;
    joint.kind = JointKind::kFixed;
    joint.range = {};
    frozen_.push_back(joint.name);
  }

  void Join(int b) {
    const Joint& joint = tree_.joints[joint_of_[b]];
    const Body& link = tree_.bodies[b];
    const Pose X_PL = joint.X_PF * joint.X_CM.inverse();
    carrier_[b] = joint.parent < 0 ? -1 : carrier_[joint.parent];
    X_CL_[b] = (joint.parent < 0 ? Pose::Identity() : X_CL_[joint.parent]) * X_PL;
    joined_.push_back(link.name);
    joined_kg_ += link.mass;
    if (!IsNegligible(link)) points_.push_back(fmt::format("{} ({:g} kg)", link.name, link.mass));
    tree_.frames[link.name] = {carrier_[b], X_CL_[b]};
    if (carrier_[b] < 0) return;
    Body& body = tree_.bodies[carrier_[b]];
    AddMass(link, X_CL_[b], &body);
    if (link.mass > 0.0 && !Contains(heavier_, body.name)) heavier_.push_back(body.name);
    body.frames.push_back({link.name, X_CL_[b]});
    for (Shape shape : link.shapes) {
      std::visit(MoveShape{X_CL_[b]}, shape.geometry);
      body.shapes.push_back(shape);
    }
  }

  void MakeMassless(int b) {
    Body& body = tree_.bodies[b];
    if (body.mass == 0.0 || HasInertia(body) || !IsNegligible(body)) return;
    massless_.push_back(body.name);
    massless_kg_ += body.mass;
    body.mass = 0.0;
    body.p_BoBcm_B.setZero();
  }

  void Retarget() {
    std::vector<Joint> joints;
    std::vector<int> lines;
    for (size_t j = 0; j < tree_.joints.size(); ++j) {
      Joint joint = tree_.joints[j];
      if (!joint.closure && joint.child >= 0 && carrier_[joint.child] != joint.child) continue;
      if (joint.parent >= 0) {
        joint.X_PF = X_CL_[joint.parent] * joint.X_PF;
        joint.parent = carrier_[joint.parent];
      }
      if (joint.child >= 0) {
        joint.X_CM = X_CL_[joint.child] * joint.X_CM;
        joint.child = carrier_[joint.child];
      }
      joints.push_back(joint);
      lines.push_back(tree_.joint_lines[j]);
    }
    tree_.joints = std::move(joints);
    tree_.joint_lines = std::move(lines);
  }

  void Compact() {
    std::vector<int> index(tree_.bodies.size(), -1);
    std::vector<Body> bodies;
    std::vector<int> lines;
    for (size_t b = 0; b < tree_.bodies.size(); ++b) {
      if (carrier_[b] != static_cast<int>(b)) continue;
      index[b] = static_cast<int>(bodies.size());
      bodies.push_back(std::move(tree_.bodies[b]));
      lines.push_back(tree_.body_lines[b]);
    }
    const auto moved = [&](int b) { return b < 0 ? b : index[b]; };
    for (Joint& joint : tree_.joints) {
      joint.parent = moved(joint.parent);
      joint.child = moved(joint.child);
    }
    for (auto& [name, frame] : tree_.frames) frame.body = moved(frame.body);
    tree_.root = moved(tree_.root);
    tree_.bodies = std::move(bodies);
    tree_.body_lines = std::move(lines);
  }

  const std::set<std::string>& keep_;
  const std::vector<std::string>& motors_;
  UrdfTree& tree_;
  double total_kg_ = 0.0;
  std::vector<int> carrier_;   // per link: itself, the link that carries it, or -1: the world
  std::vector<Pose> X_CL_;     // per link: its frame in its carrier
  std::vector<int> joint_of_;  // per link: the joint that carries it, or -1
  std::vector<std::string> joined_, heavier_, points_, frozen_, massless_;
  double joined_kg_ = 0.0, massless_kg_ = 0.0;
};

}  // namespace

void FoldFrameLinks(const std::set<std::string>& keep, const std::vector<std::string>& motors,
                    const std::string& file, UrdfTree* tree, Diagnostics* diagnostics) {
  Folder folder(keep, motors, tree);
  folder.Run();
  folder.Report(file, diagnostics);
}

}  // namespace mbv::internal
