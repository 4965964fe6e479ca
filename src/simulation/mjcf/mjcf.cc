#include "simulation/mjcf/mjcf.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include "base/text.h"
#include "simulation/mjcf/plan.h"
#include "simulation/mjcf/sections.h"

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
    } else if (principal.moments != principal.admissible) {
      xml_.Comment(fmt::format(
          " diaginertia = {} {} {} in the mechanism, which MuJoCo refuses; mbverify sets "
          "them after compilation ",
          principal.moments[0], principal.moments[1], principal.moments[2]));
    }
    xml_.Open("inertial");
    xml_.Set("pos", mechanism_.bodies[body.body].p_BoBcm_B);
    xml_.Set("mass", body.mass);
    const Eigen::Vector4d quat = mjcf::QuatOf(principal.R);
    if (quat[0] != 1.0) xml_.Set("quat", std::span<const double>(quat.data(), 4));
    xml_.Set("diaginertia", std::span<const double>(principal.admissible.data(), 3));
    xml_.Close();
  }

  void WriteJoint(const PlannedJoint& joint, const Pose& X_WB) {
    using Type = PlannedJoint::Type;
    AppendHome(joint, X_WB);
    if (joint.type == Type::kFree) return WriteFree(joint);
    xml_.Open("joint");
    xml_.Set("name", joint.name);
    const bool slide = joint.type == Type::kSlide, ball = joint.type == Type::kBall;
    xml_.Set("type", slide ? "slide" : ball ? "ball" : "hinge");
    if (!slide) xml_.Set("pos", Vec3(X_WB.inverse() * joint.p_WAnchor));
    if (!ball) xml_.Set("axis", Vec3(X_WB.linear().transpose() * joint.axis_W));
    if (joint.ref != 0.0) xml_.Set("ref", joint.ref);
    if (!ball && joint.coordinate >= 0) WriteRange(joint);
    if (ball) WriteRotation(joint);
    if (!ball && joint.coordinate >= 0) WriteForces(joint, joint.coordinate);
    xml_.Close();
  }

  void WriteFree(const PlannedJoint& joint) {
    const bool forces = joint.joint >= 0 && mjcf::ForcesOfJoint(mechanism_, joint.joint, 0).any() &&
                        mjcf::HasEqualForces(mechanism_, joint.joint);
    xml_.Open(forces ? "joint" : "freejoint");
    xml_.Set("name", joint.name);
    if (forces) {
      xml_.Set("type", "free");
      WriteForces(joint, 0);
    }
    xml_.Close();
  }

  void WriteRotation(const PlannedJoint& joint) {
    const Joint& of = mechanism_.joints[joint.joint];
    if (!HasBall(of.kind)) return;  // a hinge that transmits a force only
    if (std::isfinite(of.max_rotation)) {
      xml_.Set("range", std::array<double, 2>{0.0, of.max_rotation});
    }
    WriteForces(joint, FirstOfBall(of.kind));
  }

  // What MuJoCo has of the force elements.
  void WriteForces(const PlannedJoint& joint, int coordinate) {
    const mjcf::PlannedForces forces = mjcf::ForcesOfJoint(mechanism_, joint.joint, coordinate);
    if (forces.stiffness != 0.0) {
      xml_.Set("stiffness", forces.stiffness);
      xml_.Set("springref", forces.free);
    }
    if (forces.damping != 0.0) xml_.Set("damping", forces.damping);
    if (forces.armature != 0.0) xml_.Set("armature", forces.armature);
    if (options_.friction && forces.friction != 0.0) xml_.Set("frictionloss", forces.friction);
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

namespace mjcf {
namespace {

// XML forbids two hyphens in a comment.
std::string InComment(const std::string& text) {
  std::string safe;
  for (const char c : Printable(text)) {
    if (c == '-' && !safe.empty() && safe.back() == '-') safe += ' ';
    safe += c;
  }
  return safe;
}

const char* StaticsText() {
  return "Statics only, not for stepping in time: there is no gravity, and every piece has a mass\n"
         "of 1 kg whatever its body weighs. Springs on joints and tendons are beams and servos.\n"
         "Two ways to use it:\n"
         "1. Apply a wrench (xfrc_applied) and look for the equilibrium, where the accelerations\n"
         "   of mj_forward vanish.\n"
         "2. Read the stiffness from the springs and the Jacobians of mj_forward in this pose.\n";
}

const char* DrivesText(const MjcfOptions& options) {
  if (!options.kp.empty()) {
    return "1. As it is: every drive has a position and a velocity servo and a motor. Load the "
           "key\n"
           "   \"home\" first: its ctrl has the servos' targets and what the motors must give.\n"
           "   Other targets in ctrl move the drives; without the key the targets are 0.\n"
           "2. Held instead: switch the equalities drive:NAME on (eq_active = 1) and leave ctrl "
           "0;\n"
           "   the first number of eq_data is then a drive's distance from home.\n";
  }
  if (!options.prescribed) {
    return "1. As it is: nothing holds the drives; ctrl of the motors is the drive force [N, N "
           "m].\n"
           "   With ctrl 0 the mechanism falls from the key \"home\".\n"
           "2. Held instead: switch the equalities drive:NAME on (eq_active = 1); the first "
           "number\n"
           "   of eq_data is then a drive's distance from home.\n";
  }
  return "1. As it is: the equalities drive:NAME hold the drives at home; the first number of\n"
         "   eq_data of one is its distance from home, to be changed while stepping. Their forces\n"
         "   are constraint forces (efc_force).\n"
         "2. Force control instead: switch those equalities off (eq_active = 0); then ctrl of the "
         "motors\n"
         "   is the drive force [N, N m].\n";
}

// Force elements that MuJoCo has no word for.
std::string LackingText(const Mechanism& mechanism, const MjcfOptions& options) {
  std::string names;
  for (const std::string& line : MissingInMjcf(mechanism, options)) {
    names += "   " + InComment(line) + "\n";
  }
  if (names.empty()) return "";
  return "Not in this file, as MuJoCo 2.2 has no word for them; qfrc_applied can stand for "
         "them:\n" +
         names;
}

}  // namespace

std::string HeadComment(const Mechanism& mechanism, const MjcfOptions& options) {
  std::string text = "\n" + InComment(mechanism.name);
  if (!mechanism.description.empty()) text += ": " + InComment(mechanism.description);
  text += "\nWritten by mbverify for MuJoCo 2.2.2 and later. SI units, radians.\n\n";
  if (options.statics) return text + StaticsText();
  if (mechanism.drives.empty()) {
    text += "Two ways to use it:\n1. Step it from the key \"home\".\n";
    text += "2. Push it: xfrc_applied on bodies, qfrc_applied on joints.\n";
  } else {
    text += std::string("Two ways to use it:\n") + DrivesText(options);
  }
  text += LackingText(mechanism, options);
  text +=
      "To look only: pause, and load a key; other keys than \"home\" are poses at rest.\n"
      "Loops are closed by the equalities close:JOINT; sensors JOINT.gap say how well.\n";
  return text;
}

}  // namespace mjcf

std::vector<std::string> MissingInMjcf(const Mechanism& mechanism, const MjcfOptions& options) {
  std::vector<std::string> lines;
  for (const ForceElement& element : mechanism.elements) {
    const bool of_free =
        element.joint >= 0 && mechanism.joints[element.joint].kind == JointKind::kFree;
    if (mjcf::IsPlanned(element) && (!of_free || mjcf::HasEqualForces(mechanism, element.joint)))
      continue;
    if (options.friction && mjcf::IsPlainFriction(mechanism, element)) continue;
    lines.push_back(fmt::format("{}: {}", element.name, Described(mechanism, element)));
  }
  for (const Body& body : mechanism.bodies) {
    if (body.gravity_compensation == 0.0) continue;
    lines.push_back(fmt::format("{}: a force carries {} of its weight (gravcomp since MuJoCo 3)",
                                body.name, mjcf::NumberText(body.gravity_compensation)));
  }
  return lines;
}

std::string WithKeys(const std::string& mjcf, const std::vector<MjcfKey>& keys) {
  const size_t end = mjcf.find("    </keyframe>");
  if (end == std::string::npos) return mjcf;
  const bool servos = mjcf.find(mjcf::kPositionServo) != std::string::npos;
  std::string lines;
  for (const MjcfKey& key : keys) {
    lines += fmt::format("        <key name=\"{}\" time=\"{}\" qpos=\"{}\"", key.name,
                         mjcf::NumberText(key.time_s), mjcf::NumbersText(key.qpos));
    if (servos) {
      std::vector<double> ctrl(key.drive_position.size(), 0.0);  // motors
      for (const double position : key.drive_position) ctrl.insert(ctrl.end(), {position, 0.0});
      lines += fmt::format(" ctrl=\"{}\"", mjcf::NumbersText(ctrl));
    }
    lines += "/>\n";
  }
  return mjcf.substr(0, end) + lines + mjcf.substr(end);
}

}  // namespace mbv

namespace mbv::mjcf {
namespace {

void Option(const Sections& s, const char* element, const char* name, const char* value) {
  s.xml->Open(element);
  s.xml->Set(name, value);
  s.xml->Close();
}

// MuJoCo has room for 500 constraint rows and leaves out the rest.
void WriteSizes(const Sections& s) {
  constexpr size_t kRoom = 500;
  size_t rows = s.mechanism.drives.size() + s.mechanism.prescribed.size();
  for (const PlannedClosure& closure : s.plan.closures) {
    rows += closure.type == PlannedClosure::Type::kConnect ? 3 : 6;
  }
  if (rows <= kRoom) return;
  s.xml->Open("size");
  s.xml->Set("njmax", std::to_string(rows));
  s.xml->Close();
}

void WriteSoftness(const Sections& s) {
  s.xml->Open("equality");
  s.xml->Set("solref",
             std::array<double, 2>{s.options.time_constant_steps * s.options.step_s, 1.0});
  s.xml->Set("solimp", std::array<double, 5>{kMjcfImpedance, kMjcfImpedance, 0.001, 0.5, 2.0});
  s.xml->Close();
}

void WriteDefaults(const Sections& s) {
  s.xml->Open("default");
  if (!s.options.default_softness) WriteSoftness(s);
  Option(s, "joint", "limited", "false");
  Option(s, "tendon", "limited", "false");
  // Of all actuators: MuJoCo keeps one default for them.
  s.xml->Open("motor");
  s.xml->Set("ctrllimited", "false");
  s.xml->Set("forcelimited", "false");
  s.xml->Close();
  s.xml->Open("geom");
  s.xml->Set("contype", "0");
  s.xml->Set("conaffinity", "0");
  s.xml->Close();
  s.xml->Open("site");
  s.xml->Set("group", "3");
  s.xml->Set("size", "0.005");
  s.xml->Close();
  s.xml->Close();
}

// From this many DOFs on, MuJoCo's sparse constraint solver is faster.
constexpr int kSparseFrom = 40;

// Closing joints of loops apart.
int DofsOfTree(const Sections& s) {
  int dofs = 0;
  for (const int j : s.mechanism.tree_joints) {
    dofs += DofsOf(s.mechanism.joints[static_cast<size_t>(j)].kind);
  }
  for (const PlannedBody& body : s.plan.bodies) dofs += HasPlace(body) ? 6 : 0;
  return dofs;
}

}  // namespace

void WriteHead(const Sections& s) {
  s.xml->Comment(HeadComment(s.mechanism, s.options));
  if (std::ranges::any_of(s.plan.bodies, HasPlace)) {
    s.xml->Comment(
        " Bodies that hang on each other in long chains are cut into shorter ones: the first body "
        "of each has its place by a free joint place:BODY, and the equality close:JOINT holds it "
        "to the joint on which it hangs in the mechanism. ");
  }
  s.xml->Open("compiler");
  s.xml->Set("angle", "radian");
  s.xml->Set("autolimits", "false");
  s.xml->Set("inertiafromgeom", "false");
  s.xml->Close();
  s.xml->Open("option");
  s.xml->Set("timestep", s.options.step_s);
  s.xml->Set("gravity", s.mechanism.gravity_W);
  s.xml->Set("integrator", s.options.runge_kutta ? "RK4" : "Euler");
  s.xml->Set("solver", "Newton");
  s.xml->Set("tolerance", "1e-14");
  s.xml->Set("jacobian", DofsOfTree(s) < kSparseFrom ? "dense" : "sparse");
  s.xml->Open("flag");
  s.xml->Set("contact", "disable");
  s.xml->Set("energy", "enable");
  s.xml->Close();
  s.xml->Close();
  WriteSizes(s);
  WriteDefaults(s);
  if (!s.options.pictures) return;
  s.xml->Open("visual");
  s.xml->Open("global");
  s.xml->Set("offwidth", "2560");
  s.xml->Set("offheight", "1920");
  s.xml->Close();
  s.xml->Close();
  WriteAssets(s.mechanism, s.surfaces, s.xml);
}

}  // namespace mbv::mjcf

// Principal axes, made admissible for MuJoCo.

namespace mbv {
namespace {

// A slender or point-like body: moments below this fraction of the largest, or below that of a
// body with this radius of gyration, are raised. MuJoCo refuses zero.
constexpr double kSmallestMomentRatio = 1e-12;
constexpr double kSmallestGyration_m = 1e-7;
constexpr double kSmallestMoment = 2e-15;  // MuJoCo refuses less than 1e-15 kg m²

}  // namespace

PrincipalInertia PrincipalInertiaOf(const Mat3& I, double mass) {
  PrincipalInertia principal;
  const Mat3 off_diagonal = I - Mat3(I.diagonal().asDiagonal());
  if (off_diagonal.isZero(0.0)) {
    principal.moments = I.diagonal();
  } else {
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(Mat3(0.5 * (I + I.transpose())));
    // Descending order, right-handed.
    principal.moments = solver.eigenvalues().reverse();
    principal.R = solver.eigenvectors().rowwise().reverse();
    if (principal.R.determinant() < 0.0) principal.R.col(2) *= -1.0;
  }
  Vec3& m = principal.moments;
  const double floor = std::max(kSmallestMomentRatio * m.maxCoeff(),
                                mass * kSmallestGyration_m * kSmallestGyration_m);
  m = m.cwiseMax(floor);
  // A lamina's largest moment is the sum of the others, up to rounding.
  int k = 0;
  const double largest = m.maxCoeff(&k);
  const double others = m[(k + 1) % 3] + m[(k + 2) % 3];
  if (largest > others && largest < others * (1.0 + 1e-9)) m[k] = others;
  principal.admissible = m;
  if (largest > others) principal.admissible[k] = others;
  principal.admissible = principal.admissible.cwiseMax(kSmallestMoment);
  return principal;
}

}  // namespace mbv
