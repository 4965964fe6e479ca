#include "mjcf/mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "mjcf/plan.h"
#include "mjcf/scene.h"
#include "mjcf/sections.h"
#include "mjcf/writer.h"

namespace mbv {
namespace {

using mjcf::Plan;
using mjcf::PlannedBody;
using mjcf::PlannedClosure;
using mjcf::PlannedJoint;
using mjcf::XmlWriter;

class MjcfWriter {
 public:
  MjcfWriter(const Mechanism& mechanism, const MjcfOptions& options)
      : mechanism_(mechanism),
        options_(options),
        plan_(mjcf::MakePlan(mechanism)),
        surfaces_(mechanism, options.pictures ? mjcf::kMostTriangles : 0) {}

  std::string Write() {
    xml_.Open("mujoco");
    xml_.Set("model", mechanism_.name);
    const mjcf::Sections sections{mechanism_, options_, plan_, surfaces_, &xml_};
    mjcf::WriteHead(sections);
    WriteTree();
    mjcf::WriteTendons(sections);
    mjcf::WriteEqualities(sections);
    WriteActuators();
    mjcf::WriteSensors(sections);
    if (!options_.statics) WriteHomeKey();
    xml_.Close();
    return xml_.Text();
  }

 private:
  void WriteTree() {
    xml_.Open("worldbody");
    if (options_.pictures) mjcf::WriteSurroundings(mechanism_, &xml_);
    WriteBodyContent(0);
    xml_.Close();
  }

  void WriteBody(int index) {
    const PlannedBody& body = plan_.bodies[index];
    xml_.Open("body");
    xml_.Set("name", body.name);
    const Pose X_WB = mechanism_.X_WB_home[body.body];
    xml_.SetPose(mechanism_.X_WB_home[plan_.bodies[body.parent].body].inverse() * X_WB);
    WriteInertial(body);
    for (const PlannedJoint& joint : body.joints) WriteJoint(joint, X_WB);
    WriteBodyContent(index);
    xml_.Close();
  }

  void WriteInertial(const PlannedBody& body) {
    if (body.mass <= 0.0) return;
    const PrincipalInertia principal = PrincipalInertiaOf(body.I_Bcm_B, body.mass);
    if (plan_.tiny_mass[body.body]) {
      xml_.Comment(" massless in the mechanism; MuJoCo needs some mass ");
    }
    xml_.Open("inertial");
    xml_.Set("pos", mechanism_.bodies[body.body].p_BoBcm_B);
    xml_.Set("mass", body.mass);
    const Eigen::Vector4d quat = mjcf::QuatOf(principal.R);
    if (quat[0] != 1.0) xml_.Set("quat", std::span<const double>(quat.data(), 4));
    xml_.Set("diaginertia", std::span<const double>(principal.moments.data(), 3));
    xml_.Close();
  }

  void WriteJoint(const PlannedJoint& joint, const Pose& X_WB) {
    using Type = PlannedJoint::Type;
    AppendHome(joint, X_WB);
    if (joint.type == Type::kFree) {
      xml_.Open("freejoint");
      xml_.Set("name", joint.name);
      xml_.Close();
      return;
    }
    xml_.Open("joint");
    xml_.Set("name", joint.name);
    const bool slide = joint.type == Type::kSlide, ball = joint.type == Type::kBall;
    xml_.Set("type", slide ? "slide" : ball ? "ball" : "hinge");
    if (!slide) xml_.Set("pos", Vec3(X_WB.inverse() * joint.p_WAnchor));
    if (!ball) xml_.Set("axis", Vec3(X_WB.linear().transpose() * joint.axis_W));
    if (joint.ref != 0.0) xml_.Set("ref", joint.ref);
    if (!ball && joint.coordinate >= 0) WriteRange(joint);
    if (!ball && joint.coordinate >= 0) WriteForces(joint);
    xml_.Close();
  }

  // What MuJoCo has of the force elements.
  void WriteForces(const PlannedJoint& joint) {
    const mjcf::PlannedForces forces =
        mjcf::ForcesOfJoint(mechanism_, joint.joint, joint.coordinate);
    if (forces.stiffness != 0.0) {
      xml_.Set("stiffness", forces.stiffness);
      xml_.Set("springref", forces.free);
    }
    if (forces.damping != 0.0) xml_.Set("damping", forces.damping);
    if (forces.armature != 0.0) xml_.Set("armature", forces.armature);
  }

  // The joint's coordinates in MuJoCo's qpos, which follows the order of the file.
  void AppendHome(const PlannedJoint& joint, const Pose& X_WB) {
    using Type = PlannedJoint::Type;
    const auto append = [this](const auto& numbers) {
      home_qpos_.insert(home_qpos_.end(), numbers.begin(), numbers.end());
    };
    if (joint.type == Type::kFree) append(Vec3(X_WB.translation()));
    if (joint.type == Type::kFree) {
      append(mjcf::QuatOf(X_WB.linear()));
    } else if (joint.type == Type::kBall) {
      append(std::array<double, 4>{1.0, 0.0, 0.0, 0.0});
    } else {
      home_qpos_.push_back(joint.ref);
      home_of_joint_[joint.name] = joint.ref;
    }
  }

  // The range is stated but not enforced: a limit force would be mistaken for the drive's.
  void WriteRange(const PlannedJoint& joint) {
    const CoordinateRange& range = mechanism_.joints[joint.joint].range[joint.coordinate];
    if (std::isfinite(range.lower) && std::isfinite(range.upper) && range.lower < range.upper) {
      xml_.Set("range", std::array<double, 2>{range.lower, range.upper});
    }
  }

  // Shapes and sites of a body, then the bodies that hang on it.
  void WriteBodyContent(int index) {
    const PlannedBody& body = plan_.bodies[index];
    if (body.half_of < 0) {
      if (options_.pictures) {
        mjcf::WriteShapes(mechanism_.bodies[body.body], surfaces_, &xml_);
      }
      WriteSites(body.body);
    }
    WriteClosureSites(index);
    for (size_t i = 1; i < plan_.bodies.size(); ++i) {
      if (plan_.bodies[i].parent == index) WriteBody(static_cast<int>(i));
    }
  }

  void WriteSite(const std::string& name, const Pose& X) {
    xml_.Open("site");
    xml_.Set("name", name);
    xml_.SetPose(X);
    xml_.Close();
  }

  void WritePointSite(const std::string& name, const Vec3& p) {
    Pose X = Pose::Identity();
    X.translation() = p;
    WriteSite(name, X);
  }

  // Ends of distance drives and springs, outputs.
  void WriteSites(int body) {
    for (const Drive& drive : mechanism_.drives) {
      const auto* leg = std::get_if<DistanceDrive>(&drive.kind);
      if (leg == nullptr) continue;
      if (leg->body_from == body) WritePointSite(drive.name + ".from", leg->p_from);
      if (leg->body_to == body) WritePointSite(drive.name + ".to", leg->p_to);
    }
    for (const SpringDamper& spring : mechanism_.springs) {
      if (spring.body_from == body) WritePointSite(spring.name + ".from", spring.p_from);
      if (spring.body_to == body) WritePointSite(spring.name + ".to", spring.p_to);
    }
    for (const Output& output : mechanism_.outputs) {
      if (output.body == body) WriteSite(output.name, output.X_BO);
    }
  }

  // F and M of closing joints; of a split, on the halves' own sides.
  void WriteClosureSites(int index) {
    for (const PlannedClosure& closure : plan_.closures) {
      const Joint& joint = mechanism_.joints[closure.joint];
      const bool split = closure.type == PlannedClosure::Type::kSplit;
      const Pose& X_1 = closure.split_parent ? joint.X_PF : joint.X_CM;
      const Pose& X_2 = split ? X_1 : joint.X_PF;
      if (closure.body1 == index) WriteSite(joint.name + ".M", X_1);
      if (closure.body2 == index) WriteSite(joint.name + ".F", X_2);
    }
  }

  // One actuator on a drive's tendon or joint; `gain` is an attribute, or nullptr.
  void WriteActuator(const char* element, const std::string& name, const Drive& drive,
                     const char* gain, double value) {
    const auto* driven = std::get_if<JointDrive>(&drive.kind);
    if (driven != nullptr && !IsScalar(mechanism_.joints[driven->joint].kind, driven->coordinate))
      return;
    xml_.Open(element);
    xml_.Set("name", name);
    if (driven == nullptr) {
      xml_.Set("tendon", drive.name);
    } else {
      xml_.Set("joint", mjcf::JointName(mechanism_.joints[driven->joint], driven->coordinate));
    }
    if (gain != nullptr) xml_.Set(gain, value);
    xml_.Close();
    const auto k = static_cast<size_t>(&drive - mechanism_.drives.data());
    const bool feeds = gain == nullptr && k < options_.motor_home.size();
    home_ctrl_.push_back(feeds ? options_.motor_home[k]
                         : gain != nullptr && std::string_view(gain) == "kp" ? HomeOf(drive)
                                                                             : 0.0);
  }

  [[nodiscard]] double HomeOf(const Drive& drive) const {
    if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
      return (mechanism_.X_WB_home[leg->body_to] * leg->p_to -
              mechanism_.X_WB_home[leg->body_from] * leg->p_from)
          .norm();
    }
    const auto& driven = std::get<JointDrive>(drive.kind);
    const auto home =
        home_of_joint_.find(mjcf::JointName(mechanism_.joints[driven.joint], driven.coordinate));
    return home == home_of_joint_.end() ? 0.0 : home->second;
  }

  // The reference pose is home as well.
  void WriteHomeKey() {
    constexpr size_t kMostNumbers = 1000;  // MuJoCo 2.2.2 reads no more
    if (home_qpos_.empty() || home_qpos_.size() > kMostNumbers) return;
    xml_.Open("keyframe");
    xml_.Open("key");
    xml_.Set("name", "home");
    xml_.Set("qpos", std::span<const double>(home_qpos_));
    const bool any = std::any_of(home_ctrl_.begin(), home_ctrl_.end(),
                                 [](double value) { return value != 0.0; });
    if (any) xml_.Set("ctrl", std::span<const double>(home_ctrl_));
    xml_.Close();
    xml_.Close();
  }

  void WriteActuators() {
    if (mechanism_.drives.empty()) return;
    xml_.Open("actuator");
    for (const Drive& drive : mechanism_.drives) {
      WriteActuator("motor", drive.name, drive, nullptr, 0.0);
    }
    for (size_t k = 0; k < options_.kp.size(); ++k) {
      const Drive& drive = mechanism_.drives[k];
      WriteActuator("position", drive.name + mjcf::kPositionServo, drive, "kp", options_.kp[k]);
      WriteActuator("velocity", drive.name + mjcf::kVelocityServo, drive, "kv", options_.kv[k]);
    }
    xml_.Close();
  }

  const Mechanism& mechanism_;
  const MjcfOptions options_;
  const Plan plan_;
  const DrawnSurfaces surfaces_;
  XmlWriter xml_;
  std::vector<double> home_qpos_, home_ctrl_;  // in the order of the file
  std::map<std::string, double> home_of_joint_;
};

}  // namespace

std::string WriteMjcf(const Mechanism& mechanism, const MjcfOptions& options) {
  return MjcfWriter(mechanism, options).Write();
}

}  // namespace mbv
