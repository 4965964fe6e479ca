#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>

#include "base/markup.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "model_file/mesh/read_mesh.h"
#include "model_file/urdf/urdf_closures.h"
#include "model_file/urdf/urdf_import.h"

namespace mbv {
namespace {

// Shortest text that reads back as the same number; adding zero turns -0 into 0.
std::string Xyz(const Vec3& v) {
  return fmt::format("{} {} {}", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
}

std::string Origin(const Pose& X) {
  return fmt::format("<origin xyz=\"{}\" rpy=\"{}\"/>", Xyz(X.translation()),
                     Xyz(RpyOf(X.linear())));
}

// A cylinder in URDF stands on its z axis.
Pose StickPose(const Vec3& from, const Vec3& to) {
  Pose X = Pose::Identity();
  X.translation() = 0.5 * (from + to);
  X.linear() = LeastRotation(Vec3::UnitZ(), to - from);
  return X;
}

class ShapeWriter {
 public:
  /// `folder`: of the file.
  ShapeWriter(const Pose& X_LB, const std::string& color, std::filesystem::path folder)
      : X_LB_(X_LB), color_(color), folder_(std::move(folder)) {}
  void operator()(const Box& box) {
    Write(box.X_BG, fmt::format("<box size=\"{}\"/>", Xyz(box.size)));
  }
  void operator()(const Cylinder& c) {
    Write(StickPose(c.p_from, c.p_to), fmt::format("<cylinder radius=\"{}\" length=\"{}\"/>",
                                                   c.radius, (c.p_to - c.p_from).norm()));
  }
  void operator()(const Capsule& c) {  // URDF has no capsules
    (*this)(Cylinder{c.p_from, c.p_to, c.radius});
    (*this)(Ball{c.p_from, c.radius});
    (*this)(Ball{c.p_to, c.radius});
  }
  void operator()(const Ball& ball) {
    Pose X = Pose::Identity();
    X.translation() = ball.p_centre;
    Write(X, fmt::format("<sphere radius=\"{}\"/>", ball.radius));
  }
  void operator()(const Mesh& mesh) {
    Write(mesh.X_BG, fmt::format("<mesh filename=\"{}\" scale=\"{}\"/>",
                                 EscapeMarkup(PathSeenFrom(folder_, mesh.file)), Xyz(mesh.scale)));
  }
  std::string text;

 private:
  void Write(const Pose& X_BG, const std::string& geometry) {
    text += "    <visual>" + Origin(X_LB_ * X_BG) + "<geometry>" + geometry + "</geometry>";
    // Named materials belong to mbverify; colours as numbers are portable.
    if (const auto rgba = HexColor(color_)) {
      text += fmt::format("<material name=\"{}\"><color rgba=\"{} {} {} {}\"/></material>", color_,
                          (*rgba)[0], (*rgba)[1], (*rgba)[2], (*rgba)[3]);
    }
    text += "</visual>\n";
  }
  Pose X_LB_;
  std::string color_;
  std::filesystem::path folder_;
};

std::string LinkText(const Body& body, const Pose& X_BL, const std::filesystem::path& folder) {
  const Pose X_LB = X_BL.inverse();
  std::string text = fmt::format("  <link name=\"{}\">\n", EscapeMarkup(body.name));
  if (body.mass > 0.0) {
    const Mat3 I = X_LB.linear() * body.I_Bcm_B * X_LB.linear().transpose();
    text += fmt::format(
        "    <inertial><origin xyz=\"{}\" rpy=\"0 0 0\"/><mass value=\"{}\"/>\n"
        "      <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" "
        "izz=\"{}\"/></inertial>\n",
        Xyz(X_LB * body.p_BoBcm_B), body.mass, I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2),
        I(2, 2));
  }
  for (const Shape& shape : body.shapes) {
    ShapeWriter writer(X_LB, shape.color, folder);
    std::visit(std::ref(writer), shape.geometry);
    text += writer.text;
  }
  return text + "  </link>\n";
}

std::string LimitText(const UrdfStep& step) {
  if (step.type != "revolute" && step.type != "prismatic") return "";
  const auto bounded = [](double x) { return std::clamp(x, -kUrdfNoLimit, kUrdfNoLimit); };
  return fmt::format("<limit lower=\"{}\" upper=\"{}\" effort=\"0\" velocity=\"0\"/>",
                     bounded(step.range.lower), bounded(step.range.upper));
}

// Damping of a coordinate.
std::string DynamicsText(const Mechanism& mechanism, int joint, int coordinate) {
  double damping = 0.0;
  for (const ForceElement& element : mechanism.elements) {
    if (element.joint != joint || element.coordinate != coordinate) continue;
    if (IsUrdfDynamics(mechanism, element)) damping += std::get<DampingLaw>(element.law).damping;
  }
  return damping == 0.0 ? "" : fmt::format("<dynamics damping=\"{}\"/>", damping);
}

std::string JointText(const Mechanism& mechanism, int tree_index,
                      const std::vector<Pose>& link_frames) {
  const Joint& joint = mechanism.joints[mechanism.tree_joints[tree_index]];
  const bool reversed = mechanism.tree_reversed[tree_index];
  const int inboard = reversed ? joint.child : joint.parent;
  const int outboard = reversed ? joint.parent : joint.child;
  const Pose X_LJ = link_frames[inboard].inverse() * (reversed ? joint.X_CM : joint.X_PF);
  const std::vector<UrdfStep> steps = UrdfSteps(joint, reversed);
  std::string text, parent = mechanism.bodies[inboard].name;
  for (size_t k = 0; k < steps.size(); ++k) {
    const bool last = k + 1 == steps.size();
    const std::string child = last ? mechanism.bodies[outboard].name : steps[k].name + ".link";
    if (!last) text += fmt::format("  <link name=\"{}\"/>\n", EscapeMarkup(child));
    text += fmt::format(
        "  <joint name=\"{}\" type=\"{}\">{}<parent link=\"{}\"/>"
        "<child link=\"{}\"/>",
        EscapeMarkup(steps[k].name), steps[k].type, Origin(k == 0 ? X_LJ : Pose::Identity()),
        EscapeMarkup(parent), EscapeMarkup(child));
    if (steps[k].type != "fixed" && steps[k].type != "floating") {
      text += fmt::format("<axis xyz=\"{}\"/>", Xyz(steps[k].axis));
    }
    text += LimitText(steps[k]) +
            DynamicsText(mechanism, mechanism.tree_joints[tree_index], steps[k].coordinate) +
            "</joint>\n";
    parent = child;
  }
  return text;
}

}  // namespace

namespace {

// What acts on a ball's rotation has no place in three hinges: a free joint carries the body, and
// the ball is a closure beside it.
void CutBallsWithForces(Mechanism* m) {
  for (size_t t = 0; t < m->tree_joints.size(); ++t) {
    const int j = m->tree_joints[t];
    Joint& ball = m->joints[static_cast<size_t>(j)];
    const bool acts = std::ranges::any_of(
        m->elements, [j](const ForceElement& element) { return element.joint == j; });
    if (ball.kind != JointKind::kSpherical || (!acts && std::isinf(ball.max_rotation))) continue;
    Joint free;
    free.name = ball.name + ".free";
    free.kind = JointKind::kFree;
    free.parent = ball.parent;
    free.X_PF = ball.X_PF;
    free.child = ball.child;
    free.X_CM = ball.X_CM;
    free.home = free.guess = CoordinatesOf(free, JointPose(ball, ball.home));
    ball.closure = true;
    m->tree_joints[t] = static_cast<int>(m->joints.size());
    m->joints.push_back(std::move(free));
  }
}

}  // namespace

Mechanism WithBallsAtZero(const Mechanism& mechanism) {
  Mechanism straight = mechanism;
  CutBallsWithForces(&straight);
  std::vector<bool> named(straight.joints.size(), false);  // by drives: their zero is meant
  for (const Drive& drive : mechanism.drives) {
    if (const auto* on = std::get_if<JointDrive>(&drive.kind)) named[size_t(on->joint)] = true;
  }
  for (const int index : straight.tree_joints) {
    Joint& joint = straight.joints[size_t(index)];
    const bool limited = std::any_of(
        joint.range.begin(), joint.range.begin() + 3,
        [](const CoordinateRange& r) { return std::isfinite(r.lower) || std::isfinite(r.upper); });
    if (joint.kind != JointKind::kSpherical || limited || named[size_t(index)]) continue;
    joint.X_PF.linear() = joint.X_PF.linear() * JointPose(joint, joint.home).linear();
    joint.home = joint.guess = {};
  }
  return straight;
}

std::vector<UrdfStep> UrdfSteps(const Joint& joint, bool reversed) {
  const auto step = [&](const std::string& suffix, int coordinate, const Vec3& axis) {
    const CoordinateRange& range = joint.range[coordinate];
    const bool limited = std::isfinite(range.lower) || std::isfinite(range.upper);
    const std::string type = IsLength(joint.kind, coordinate) ? "prismatic"
                             : limited                        ? "revolute"
                                                              : "continuous";
    return UrdfStep{suffix.empty() ? joint.name : joint.name + "." + suffix, type,
                    reversed ? Vec3(-axis) : axis, range, coordinate};
  };
  const auto direction = [&](int coordinate) {
    std::array<double, 6> unit{};
    unit[coordinate] = 1.0;
    return Vec3(JointPose(joint, unit).translation());
  };
  const auto ball = [&](int first) {
    return std::vector{step("yaw", first + 2, Vec3::UnitZ()),
                       step("pitch", first + 1, Vec3::UnitY()), step("roll", first, Vec3::UnitX())};
  };
  std::vector<UrdfStep> steps;
  switch (joint.kind) {
    case JointKind::kFixed:
      return {{joint.name, "fixed", Vec3::UnitX(), {}, -1}};
    case JointKind::kFree:
      return {{joint.name, "floating", Vec3::UnitX(), {}, -1}};
    case JointKind::kRevolute:
    case JointKind::kPrismatic:
      steps = {step("", 0, joint.axis)};
      break;
    case JointKind::kCylindrical:
      steps = {step("slide", 0, joint.axis), step("turn", 1, joint.axis)};
      break;
    case JointKind::kUniversal:
      steps = {step("first", 0, joint.axis), step("second", 1, joint.axis2)};
      break;
    case JointKind::kSpherical:
      steps = ball(0);
      break;
    case JointKind::kPlanar:
      steps = {step("u", 0, direction(0)), step("v", 1, direction(1)), step("turn", 2, joint.axis)};
      break;
    case JointKind::kPointOnLine:
      steps = ball(1);
      steps.insert(steps.begin(), step("slide", 0, joint.axis));
      break;
    case JointKind::kPointOnPlane:
      steps = ball(2);
      steps.insert(steps.begin(), {step("u", 0, direction(0)), step("v", 1, direction(1))});
      break;
  }
  if (reversed) std::reverse(steps.begin(), steps.end());
  return steps;
}

bool IsUrdfDynamics(const Mechanism& mechanism, const ForceElement& element) {
  if (element.joint < 0) return false;
  if (!std::holds_alternative<DampingLaw>(element.law)) return false;
  const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
  return !joint.closure && joint.kind != JointKind::kFree;
}

std::vector<Pose> UrdfLinkFrames(const Mechanism& mechanism) {
  std::vector<Pose> frames(mechanism.bodies.size(), Pose::Identity());
  for (size_t t = 0; t < mechanism.tree_joints.size(); ++t) {
    const Joint& joint = mechanism.joints[mechanism.tree_joints[t]];
    if (mechanism.tree_reversed[t]) {
      frames[joint.parent] = joint.X_PF;
    } else {
      frames[joint.child] = joint.X_CM;
    }
  }
  return frames;
}

std::optional<std::array<double, 4>> HexColor(const std::string& text) {
  if ((text.size() != 7 && text.size() != 9) || text[0] != '#') return std::nullopt;
  std::array<double, 4> rgba = {0, 0, 0, 1};
  for (size_t k = 0; 2 * k + 1 < text.size(); ++k) {
    unsigned value = 0;
    for (const char c : text.substr(1 + 2 * k, 2)) {
      if (std::isxdigit(static_cast<unsigned char>(c)) == 0) return std::nullopt;
      value = value * 16 + static_cast<unsigned>(c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10);
    }
    rgba[k] = value / 255.0;
  }
  return rgba;
}

std::string WriteUrdf(const Mechanism& original) {
  const Mechanism mechanism = WithBallsAtZero(original);
  const std::vector<Pose> frames = UrdfLinkFrames(mechanism);
  std::string comment = WriteUrdfCompanion(mechanism, mechanism.name + ".urdf");
  // XML forbids two hyphens in a comment.
  for (size_t at; (at = comment.find("--")) != std::string::npos;) comment.erase(at, 1);
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<!-- {0}, by mbverify: spanning tree, and the closed loops as constraint elements, which\n"
      "plain URDF does not know. As model.yaml, the lines below complete this file.\n{1}-->\n"
      "<robot name=\"{0}\">\n",
      EscapeMarkup(mechanism.name), comment);
  for (size_t b = 0; b < mechanism.bodies.size(); ++b) {
    text += LinkText(mechanism.bodies[b], frames[b],
                     std::filesystem::path(mechanism.file).parent_path());
  }
  for (size_t t = 0; t < mechanism.tree_joints.size(); ++t) {
    text += JointText(mechanism, static_cast<int>(t), frames);
  }
  return text + internal::ConstraintText(mechanism, frames) + "</robot>\n";
}

}  // namespace mbv
