#include "model_file/urdf/urdf_closures.h"

#include <fmt/format.h>
#include <tinyxml2.h>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>

#include "base/text.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"
#include "model_file/catalogue.h"
#include "model_file/element_text.h"
#include "model_file/model_contacts.h"
#include "model_file/urdf/urdf_import.h"
#include "model_file/write_model.h"

namespace mbv::internal {
namespace {

using tinyxml2::XMLElement;

// The words in use for kinds of closures; a free joint closes nothing.
std::optional<JointKind> KindOf(const std::string& type) {
  if (type == "continuous") return JointKind::kRevolute;
  if (type == "ball") return JointKind::kSpherical;
  for (const JointKindRow& row : kJointKindRows) {
    if (row.word == type && row.kind != JointKind::kFree) return row.kind;
  }
  return std::nullopt;
}

const char* Attribute(const XMLElement* element, const char* name) {
  return element == nullptr ? nullptr : element->Attribute(name);
}

class ClosureReader {
 public:
  ClosureReader(std::string file, Diagnostics* diagnostics)
      : file_(std::move(file)), diagnostics_(diagnostics) {}

  std::optional<UrdfClosure> Read(const XMLElement& element) {
    good_ = true;
    const std::string tag = element.Name();
    UrdfClosure closure;
    closure.line = element.GetLineNum();
    closure.joint.closure = true;
    if (tag == "drake:ball_constraint") {
      ReadDrakeBall(element, &closure);
    } else {
      ReadHead(element, &closure);
      if (tag == "constraint") ReadConstraint(element, &closure);
      if (tag == "loop") ReadLoop(element, &closure);
      if (tag == "loop_joint") ReadLoopJoint(element, &closure);
    }
    if (!good_) return std::nullopt;
    return closure;
  }

 private:
  void Error(const XMLElement& at, const std::string& text, const std::string& hint = "") {
    diagnostics_->Add({Severity::kError, file_, at.GetLineNum(), 1, text, hint});
    good_ = false;
  }
  [[nodiscard]] std::string Where(const XMLElement& element) const {
    const char* name = element.Attribute("name");
    return fmt::format("<{}{}>", element.Name(), name ? fmt::format(" '{}'", name) : "");
  }

  Vec3 ReadVector(const XMLElement& owner, const char* text, const char* what) {
    std::istringstream stream(text);
    stream.imbue(std::locale::classic());
    Vec3 v = Vec3::Zero();
    std::string rest;
    if (!(stream >> v.x() >> v.y() >> v.z()) || stream >> rest || !v.allFinite()) {
      Error(owner, fmt::format("{}: {} = '{}' is not three numbers", Where(owner), what, text));
      return Vec3::Zero();
    }
    return v;
  }
  // The pose in the attributes xyz and rpy; the identity where the element is left out.
  Pose ReadOrigin(const XMLElement& owner, const XMLElement* element) {
    Pose X = Pose::Identity();
    if (const char* xyz = Attribute(element, "xyz")) {
      X.translation() = ReadVector(owner, xyz, "xyz");
    }
    if (const char* rpy = Attribute(element, "rpy")) {
      X.linear() = RotRpy(ReadVector(owner, rpy, "rpy"));
    }
    return X;
  }
  std::string ReadLink(const XMLElement& owner, const XMLElement* element, const char* what,
                       const char* attribute = "link") {
    if (const char* link = Attribute(element, attribute)) return link;
    Error(owner, fmt::format("{}: <{} {}=\"…\"> is missing", Where(owner), what, attribute));
    return "";
  }
  // A unit axis; empty where it is left out.
  std::optional<Vec3> ReadAxis(const XMLElement& owner, const char* name) {
    const char* xyz = Attribute(owner.FirstChildElement(name), "xyz");
    if (xyz == nullptr) return std::nullopt;
    const Vec3 axis = ReadVector(owner, xyz, name);
    if (good_ && !(axis.norm() > 1e-9)) {
      Error(owner, fmt::format("{}: {} = '{}' has no direction", Where(owner), name, xyz));
    }
    return axis.norm() > 0.0 ? Vec3(axis.normalized()) : axis;
  }

  void ReadHead(const XMLElement& element, UrdfClosure* closure) {
    const char* name = element.Attribute("name");
    if (name == nullptr) Error(element, fmt::format("<{}> has no name", element.Name()));
    closure->joint.name = name == nullptr ? "" : name;
    const char* type = element.Attribute("type");
    const auto kind = KindOf(type == nullptr ? "" : type);
    if (!kind) {
      Error(
          element,
          fmt::format("{}: type = '{}' is not a kind of closure", Where(element), type ? type : ""),
          "fixed, revolute, continuous, prismatic, cylindrical, universal, spherical, ball or "
          "planar");
    }
    closure->joint.kind = kind.value_or(JointKind::kFixed);
  }

  // Axes on the two sides: of the same components, or the child frame is turned until they are.
  void SetAxes(const XMLElement& element, const std::optional<Vec3>& on_parent,
               const std::optional<Vec3>& on_child, UrdfClosure* closure) {
    Joint& joint = closure->joint;
    if (!good_ || RowOf(joint.kind).axes == 0) return;
    if (joint.kind == JointKind::kUniversal) {
      if (!on_parent || !on_child) {
        Error(element,
              fmt::format("{}: a universal joint needs an axis on each side", Where(element)),
              "parent_axis and child_axis");
        return;
      }
      joint.axis = *on_parent;
      joint.axis2 = *on_child;
      if (joint.axis.cross(joint.axis2).norm() > 1e-6) return;
      Error(element, fmt::format("{}: the two axes are parallel", Where(element)));
      return;
    }
    joint.axis = on_parent.value_or(on_child.value_or(Vec3::UnitX()));  // URDF's default
    if (!on_child || on_child->isApprox(joint.axis, 1e-12)) return;
    const Mat3 turn = LeastRotation(joint.axis, *on_child);
    joint.X_CM.linear() = joint.X_CM.linear() * turn;
  }

  void ReadConstraint(const XMLElement& element, UrdfClosure* closure) {
    closure->parent = ReadLink(element, element.FirstChildElement("parent"), "parent");
    closure->child = ReadLink(element, element.FirstChildElement("child"), "child");
    closure->joint.X_PF = ReadOrigin(element, element.FirstChildElement("parent_origin"));
    closure->joint.X_CM = ReadOrigin(element, element.FirstChildElement("child_origin"));
    const auto on_parent = ReadAxis(element, "parent_axis");
    const auto on_child = ReadAxis(element, "child_axis");
    SetAxes(element, on_parent ? on_parent : ReadAxis(element, "axis"), on_child, closure);
  }

  void ReadLoop(const XMLElement& element, UrdfClosure* closure) {
    const auto side = [&](const char* tag, std::string* link, Pose* X) {
      const XMLElement* found = element.FirstChildElement(tag);
      *link = ReadLink(element, found, tag);
      if (found != nullptr) *X = ReadOrigin(element, found->FirstChildElement("origin"));
    };
    side("predecessor", &closure->parent, &closure->joint.X_PF);
    side("successor", &closure->child, &closure->joint.X_CM);
    SetAxes(element, ReadAxis(element, "axis"), ReadAxis(element, "successor_axis"), closure);
  }

  void ReadLoopJoint(const XMLElement& element, UrdfClosure* closure) {
    const XMLElement* first = element.FirstChildElement("link1");
    if (first == nullptr && element.FirstChildElement("parent") != nullptr) {
      ReadConstraint(element, closure);
      return;
    }
    // Isaac Sim's documentation writes <link1> twice.
    const XMLElement* second = element.FirstChildElement("link2");
    if (second == nullptr && first != nullptr) second = first->NextSiblingElement("link1");
    closure->parent = ReadLink(element, first, "link1");
    closure->child = ReadLink(element, second, "link2");
    closure->joint.X_PF = ReadOrigin(element, first);
    closure->joint.X_CM = ReadOrigin(element, second);
    SetAxes(element, ReadAxis(element, "axis"), std::nullopt, closure);
  }

  void ReadDrakeBall(const XMLElement& element, UrdfClosure* closure) {
    const auto part = [&](const char* name) { return element.FirstChildElement(name); };
    closure->joint.kind = JointKind::kSpherical;
    closure->parent = ReadLink(element, part("drake:ball_constraint_body_A"),
                               "drake:ball_constraint_body_A", "name");
    closure->child = ReadLink(element, part("drake:ball_constraint_body_B"),
                              "drake:ball_constraint_body_B", "name");
    closure->joint.name = closure->parent + "_" + closure->child;
    if (const char* p = Attribute(part("drake:ball_constraint_p_AP"), "value")) {
      closure->joint.X_PF.translation() = ReadVector(element, p, "p_AP");
    }
    if (const char* p = Attribute(part("drake:ball_constraint_p_BQ"), "value")) {
      closure->joint.X_CM.translation() = ReadVector(element, p, "p_BQ");
    }
  }

  std::string file_;
  Diagnostics* diagnostics_;
  bool good_ = true;
};

// A gear ratio anywhere inside a <transmission>: dialects put it below the joint, the actuator or
// the transmission itself.
void WarnOfReduction(const XMLElement& element, const char* transmission, const std::string& file,
                     Diagnostics* diagnostics) {
  for (const XMLElement* e = element.FirstChildElement(); e != nullptr;
       e = e->NextSiblingElement()) {
    WarnOfReduction(*e, transmission, file, diagnostics);
    const std::string tag = e->Name();
    if (tag != "mechanicalReduction" && tag != "mechanical_reduction") continue;
    double ratio = 0.0;
    if (e->QueryDoubleText(&ratio) == tinyxml2::XML_SUCCESS && ratio == 1.0) continue;
    const char* text = e->GetText();
    diagnostics->Add(
        {Severity::kWarning, file, e->GetLineNum(), 1,
         fmt::format("transmission '{}': the reduction {} is left out",
                     transmission == nullptr ? "" : transmission, text == nullptr ? "" : text),
         "positions and forces are those of the joint, not of the motor"});
  }
}

constexpr const char* kMass = "masses and inertias are other ones";
constexpr const char* kFluid = "a fluid drags and lifts every body";
constexpr const char* kWeight = "the link has no weight";

const UrdfForceRow kForceRows[] = {
    {"gazebo", "joint", "", "", "the loop that it may close is open"},
    {"gazebo", "turnGravityOff", "text", "false|0", kWeight},
    {"gazebo", "gravity", "text", "true|1", kWeight},
    {"gazebo", "dampingFactor", "text", "0|0.0", "a damper acts on the link"},
    {"gazebo", "fluid_density", "text", "0|0.0", kFluid},
    {"gazebo", "wind", "", "", kFluid},
    {"gazebo", "enable_wind", "text", "false|0", kFluid},
    {"coupling", "coupling", "", "", "the joints turn apart"},
    {"mujoco", "option", "density", "0|0.0", kFluid},
    {"mujoco", "option", "viscosity", "0|0.0", kFluid},
    {"mujoco", "flag", "passive", "enable", "dampers do not act"},
    {"mujoco", "flag", "equality", "enable", "loops are open"},
    {"mujoco", "flag", "constraint", "enable", "loops are open and dry friction does not act"},
    {"mujoco", "flag", "frictionloss", "enable", "dry friction does not act"},
    {"mujoco", "compiler", "settotalmass", "-1|0", kMass},
    {"mujoco", "compiler", "boundmass", "0|0.0", kMass},
    {"mujoco", "compiler", "boundinertia", "0|0.0", kMass},
    {"mujoco", "compiler", "balanceinertia", "false", kMass},
    {"mujoco", "compiler", "inertiafromgeom", "false|auto", kMass},
    {"", "drake:linear_bushing_rpy", "", "", "a bushing acts between two frames"},
    {"", "drake:linear_spring_damper", "", "", "a spring acts between two points"},
    {"", "drake:mimic", "", "", "the joint follows another one"},
    {"joint", "dynamics", "spring_stiffness", "0|0.0", "a spring acts on the joint"},
    {"joint", "dynamics", "rotor_inertia", "0|0.0", "a rotor turns with the joint"},
    {"joint", "dynamics", "armature", "0|0.0", "a rotor turns with the joint"},
    {"joint", "dynamics", "stiffness", "0|0.0", "a spring acts on the joint"},
};

constexpr const char* kSprung = "it acts on joints or links as a spring or damper";
constexpr const char* kSent = "it applies forces that other programs send";
constexpr const char* kFlow = "it applies forces of a fluid";
constexpr const char* kHolds = "it joins bodies while it runs";
constexpr const char* kMoves = "it moves or pushes the base";

const UrdfPluginRow kPluginRows[] = {
    {"mimic", "the joint follows another one"},
    {"spring", kSprung},
    {"damp", kSprung},
    {"friction", "dry friction acts"},
    {"hydrodynamic", kFlow},
    {"buoyan", kFlow},
    {"wind", kFlow},
    {"lift_drag", kFlow},
    {"liftdrag", kFlow},
    {"propeller", kFlow},
    {"thruster", kFlow},
    {"rotor", kFlow},
    {"motor_model", kFlow},
    {"multicopter", kFlow},
    {"gripper", kHolds},
    {"vacuum", kHolds},
    {"detachable", kHolds},
    {"attach", kHolds},
    {"diff_drive", kMoves},
    {"diffdrive", kMoves},
    {"planar_move", kMoves},
    {"skid_steer", kMoves},
    {"ackermann", kMoves},
    {"force_torque", nullptr},
    {"ft_sensor", nullptr},
    {"force", kSent},
    {"wrench", kSent},
    // Their forces are those of drives.
    {"ros_control", nullptr},
    {"ros2_control", nullptr},
    {"joint_position_controller", nullptr},
    {"jointpositioncontroller", nullptr},
    {"joint_trajectory", nullptr},
    {"jointtrajectory", nullptr},
    // These measure or publish.
    {"joint_state", nullptr},
    {"jointstate", nullptr},
    {"pose_publisher", nullptr},
    {"posepublisher", nullptr},
    {"odometry", nullptr},
    {"p3d", nullptr},
    {"camera", nullptr},
    {"kinect", nullptr},
    {"imu", nullptr},
    {"laser", nullptr},
    {"ray_sensor", nullptr},
    {"lidar", nullptr},
    {"gps", nullptr},
    {"bumper", nullptr},
    {"contact_sensor", nullptr},
    {"sensors_system", nullptr},
};

std::string Trimmed(const char* text) {
  const std::string all = text == nullptr ? "" : text;
  const size_t from = all.find_first_not_of(" \t\r\n"), to = all.find_last_not_of(" \t\r\n");
  return from == std::string::npos ? "" : all.substr(from, to - from + 1);
}

// What simulators add: taken, or left out with what it does.
class ExtraReader {
 public:
  ExtraReader(std::string file, Diagnostics* diagnostics, UrdfDetails* details)
      : file_(std::move(file)), diagnostics_(*diagnostics), details_(*details) {}

  void Read(const XMLElement& section) {
    section_ = section.Name();
    const char* owner = section.Attribute("reference");
    if (owner == nullptr) owner = section.Attribute("name");
    owner_ = owner == nullptr ? "" : owner;
    if (section_ == "transmission") {
      WarnOfReduction(section, section.Attribute("name"), file_, &diagnostics_);
      ReadRotor(section);
    }
    if (section_ == "gazebo") {
      if (const auto k = NumberOf(section.FirstChildElement("springStiffness"))) {
        At(owner_, section).stiffness = *k;
      }
      if (const auto q = NumberOf(section.FirstChildElement("springReference"))) {
        At(owner_, section).free = *q;
      }
    }
    if (section_ == "mujoco") ReadGravity(section);
    LookUp(section);
  }

 private:
  void Warn(const XMLElement& at, const std::string& text, const std::string& hint) {
    diagnostics_.Add({Severity::kWarning, file_, at.GetLineNum(), 1, text, hint});
  }
  void LeaveOut(const XMLElement& at, const std::string& what, const char* effect) {
    details_.left_out.push_back(
        {.kind = ModelCaveat::Kind::kLeftOut,
         .text = fmt::format("{}{} is left out: {}", what,
                             owner_.empty() ? "" : fmt::format(" ('{}')", owner_), effect),
         .source = section_ + "/" + at.Name()});
    Warn(at, details_.left_out.back().text,
         section_ == "coupling" ? "state it under `couplings` of a model file"
         : std::string_view(at.Name()) == "joint"
             ? "if it closes a loop, state it as <constraint> or under `joints` of the model file"
             : "forces are computed without it");
  }

  UrdfDetails::Extra& At(const std::string& joint, const XMLElement& at) {
    UrdfDetails::Extra& extra = details_.extras[joint];
    extra.line = at.GetLineNum();
    return extra;
  }

  // Of the text, or of the attribute `value`.
  static std::optional<double> NumberOf(const XMLElement* e) {
    double x = 0.0;
    if (e == nullptr) return std::nullopt;
    if (e->QueryDoubleAttribute("value", &x) == tinyxml2::XML_SUCCESS) return x;
    if (e->QueryDoubleText(&x) == tinyxml2::XML_SUCCESS) return x;
    return std::nullopt;
  }

  // Drake: <actuator> of a transmission with drake:rotor_inertia and drake:gear_ratio.
  void ReadRotor(const XMLElement& transmission) {
    const XMLElement* joint = transmission.FirstChildElement("joint");
    const char* name = joint == nullptr ? nullptr : joint->Attribute("name");
    for (const XMLElement* a = transmission.FirstChildElement("actuator"); a != nullptr;
         a = a->NextSiblingElement("actuator")) {
      const auto inertia = NumberOf(a->FirstChildElement("drake:rotor_inertia"));
      if (!inertia || *inertia == 0.0) continue;
      if (name == nullptr) {
        LeaveOut(*a, "drake:rotor_inertia", "a rotor turns with a joint that is not named");
        continue;
      }
      At(name, *a).rotor_inertia = *inertia;
      details_.extras[name].gear_ratio =
          NumberOf(a->FirstChildElement("drake:gear_ratio")).value_or(1.0);
    }
  }

  void ReadGravity(const XMLElement& mujoco) {
    const XMLElement* option = mujoco.FirstChildElement("option");
    if (option == nullptr) return;
    if (const char* text = option->Attribute("gravity")) {
      std::istringstream stream(text);
      Vec3 g = Vec3::Zero();
      if (stream >> g.x() >> g.y() >> g.z()) details_.gravity_W = g;
    }
    const XMLElement* flag = option->FirstChildElement("flag");
    const char* off = flag == nullptr ? nullptr : flag->Attribute("gravity");
    if (off != nullptr && std::string_view(off) == "disable") details_.gravity_W = Vec3::Zero();
    if (details_.gravity_W) {
      Warn(*option,
           fmt::format("gravity is ({:g}, {:g}, {:g}) m/s², as <mujoco> says",
                       details_.gravity_W->x(), details_.gravity_W->y(), details_.gravity_W->z()),
           "`gravity` of a model file goes before it");
    }
  }

  // By its file, else by its name: names are chosen freely.
  void ReadPlugin(const XMLElement& plugin) {
    const char* file = plugin.Attribute("filename");
    const char* name = plugin.Attribute("name");
    const std::string word = file != nullptr ? file : name != nullptr ? name : "";
    const UrdfPluginRow* row = FindUrdfPlugin(word);
    if (row == nullptr && file != nullptr && name != nullptr) row = FindUrdfPlugin(name);
    if (row != nullptr && row->effect == nullptr) return;
    LeaveOut(plugin, word.empty() ? "<plugin>" : "<plugin> " + QuotedValue(word),
             row == nullptr ? "what it does to forces is not known" : row->effect);
  }

  void LookUp(const XMLElement& e) {
    if (section_ == "gazebo" && std::string_view(e.Name()) == "sensor") return;
    if (section_ == "gazebo" && std::string_view(e.Name()) == "plugin") {
      ReadPlugin(e);
      return;
    }
    for (const UrdfForceRow& row : kForceRows) {
      if (*row.section != '\0' && section_ != row.section) continue;
      if (std::string_view(e.Name()) != row.element) continue;
      const std::string_view of = row.value;
      if (of.empty()) {
        LeaveOut(e,
                 row.element == std::string_view("joint") ? "a joint inside <gazebo>"
                                                          : fmt::format("<{}>", row.element),
                 row.effect);
        continue;
      }
      const char* attribute = of == "text" ? nullptr : e.Attribute(row.value);
      if (of != "text" && attribute == nullptr) continue;
      const std::string value = of == "text" ? Trimmed(e.GetText()) : attribute;
      if (value.empty() || IsNeutralValue(row.neutral, value)) continue;
      LeaveOut(e,
               of == "text" ? fmt::format("<{}> {}", row.element, value)
                            : fmt::format("{} = {} of <{}>", row.value, value, row.element),
               row.effect);
    }
    for (const XMLElement* inner = e.FirstChildElement(); inner != nullptr;
         inner = inner->NextSiblingElement()) {
      LookUp(*inner);
    }
  }

  std::string file_, section_, owner_;
  Diagnostics& diagnostics_;
  UrdfDetails& details_;
};

std::string Numbers(const Vec3& v) {
  return fmt::format("{} {} {}", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
}

std::string Escaped(const std::string& text) {
  tinyxml2::XMLPrinter printer(nullptr, true);
  printer.PushText(text.c_str());
  return printer.CStr();
}

}  // namespace

std::span<const UrdfForceRow> UrdfForceRows() { return kForceRows; }

std::span<const UrdfPluginRow> UrdfPluginRows() { return kPluginRows; }

const UrdfPluginRow* FindUrdfPlugin(std::string name) {
  for (char& c : name) {
    c = c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  for (const UrdfPluginRow& row : kPluginRows) {
    if (name.find(row.part) != std::string::npos) return &row;
  }
  return nullptr;
}

bool IsNeutralValue(const std::string& neutral, const std::string& value) {
  std::istringstream words(neutral);
  for (std::string word; std::getline(words, word, '|');) {
    if (value == word) return true;
  }
  char* end = nullptr;
  const double x = std::strtod(value.c_str(), &end);
  const bool zero_does_nothing = neutral.find('0') != std::string::npos;
  return zero_does_nothing && end != value.c_str() && *end == '\0' && x == 0.0;
}

UrdfDetails ReadUrdfDetails(const std::string& text, const std::string& file,
                            Diagnostics* diagnostics) {
  UrdfDetails details;
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) return details;
  const XMLElement* robot = document.FirstChildElement("robot");
  if (robot == nullptr) return details;
  ClosureReader reader(file, diagnostics);
  ExtraReader extras(file, diagnostics, &details);
  for (const XMLElement* e = robot->FirstChildElement(); e != nullptr;
       e = e->NextSiblingElement()) {
    const std::string tag = e->Name();
    const char* name = e->Attribute("name");
    if (tag == "link" && name != nullptr) details.link_lines.emplace(name, e->GetLineNum());
    if (tag == "joint" && name != nullptr) details.joint_lines.emplace(name, e->GetLineNum());
    if (tag == "constraint" || tag == "loop" || tag == "loop_joint" ||
        tag == "drake:ball_constraint") {
      if (const auto closure = reader.Read(*e)) details.closures.push_back(*closure);
    }
    extras.Read(*e);
    if (tag == "transmission") {
      for (const XMLElement* j = e->FirstChildElement("joint"); j != nullptr;
           j = j->NextSiblingElement("joint")) {
        const char* driven = j->Attribute("name");
        if (driven != nullptr && !Contains(details.transmission_joints, driven)) {
          details.transmission_joints.emplace_back(driven);
        }
      }
    }
  }
  return details;
}

std::string ConstraintText(const Mechanism& mechanism, const std::vector<Pose>& link_frames) {
  std::string text;
  for (const Joint& joint : mechanism.joints) {
    if (!joint.closure || joint.kind == JointKind::kFree) continue;  // a free joint closes nothing
    const auto side = [&](const char* name, int body, const Pose& X_BF, const Vec3& axis) {
      const Pose X = link_frames[body].inverse() * X_BF;
      std::string lines =
          fmt::format("    <{0} link=\"{1}\"/><{0}_origin xyz=\"{2}\" rpy=\"{3}\"/>", name,
                      Escaped(mechanism.bodies[body].name), Numbers(X.translation()),
                      Numbers(RpyOf(X.linear())));
      if (RowOf(joint.kind).axes > 0)
        lines += fmt::format("<{}_axis xyz=\"{}\"/>", name, Numbers(axis));
      return lines + "\n";
    };
    const bool universal = RowOf(joint.kind).axes > 1;
    text += fmt::format("  <constraint name=\"{}\" type=\"{}\">\n", Escaped(joint.name),
                        WordOf(joint.kind)) +
            side("parent", joint.parent, joint.X_PF, joint.axis) +
            side("child", joint.child, joint.X_CM, universal ? joint.axis2 : joint.axis) +
            "  </constraint>\n";
  }
  return text;
}

}  // namespace mbv::internal

// The model.yaml that completes an exported URDF file.

namespace mbv {
namespace {

std::string YamlName(std::string name) {
  std::replace_if(
      name.begin(), name.end(),
      [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '_'; }, '_');
  return name;
}

std::string List(const Vec3& v) {
  return fmt::format("[{}, {}, {}]", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
}

std::string RangeText(const CoordinateRange& range) {
  const auto bound = [](double x) { return std::isfinite(x) ? fmt::format("{}", x) : "null"; };
  return fmt::format("[{}, {}]", bound(range.lower), bound(range.upper));
}

bool IsLimited(const CoordinateRange& range) {
  return std::isfinite(range.lower) || std::isfinite(range.upper);
}

class Companion {
 public:
  explicit Companion(const Mechanism& mechanism)
      : m_(WithBallsAtZero(mechanism)), link_frames_(UrdfLinkFrames(m_)) {}

  std::string Text(const std::string& urdf_file) {
    WriteGuesses();
    WriteClosures();
    WriteDrives();
    WriteRest();
    std::string text =
        fmt::format("name: {}\nurdf:\n  file: \"{}\"\n  constraints: false\n{}{}{}gravity: {}\n",
                    YamlName(m_.name), urdf_file, guesses_.empty() ? "" : "  guess:\n", guesses_,
                    CompensationText(), List(m_.gravity_W));
    if (std::ranges::any_of(m_.bodies,
                            [](const Body& b) { return !ImpossibleInertia(b).empty(); })) {
      text += "allow: impossible_inertia\n";
    }
    if (!attached_.empty()) text += "attach:\n";
    for (const auto& [body, frames] : attached_) {
      text += fmt::format("  \"{}\":\n{}", m_.bodies[body].name, frames);
    }
    for (const auto& [section, lines] : sections_) text += section + ":\n" + lines;
    return text;
  }

 private:
  // Adds a frame to a link and gives its name for references.
  std::string Attach(int body, const std::string& name, const Pose& X_BF) {
    const Pose X_LF = link_frames_[body].inverse() * X_BF;
    attached_[body] += fmt::format("    {}: {{position: {}, rotation: {{rpy: {}}}}}\n", name,
                                   List(X_LF.translation()), List(RpyOf(X_LF.linear())));
    return fmt::format("\"{}.{}\"", m_.bodies[body].name, name);
  }
  std::string AttachPoint(int body, const std::string& name, const Vec3& p) {
    Pose X = Pose::Identity();
    X.translation() = p;
    return Attach(body, name, X);
  }

  void WriteGuesses() {
    for (size_t t = 0; t < m_.tree_joints.size(); ++t) {
      const Joint& joint = m_.joints[m_.tree_joints[t]];
      if (joint.kind == JointKind::kFree) {
        Joint plain = joint;
        const Pose X_FM = JointPose(joint, joint.home);
        const auto home = CoordinatesOf(plain, m_.tree_reversed[t] ? X_FM.inverse() : X_FM);
        guesses_ += fmt::format("    \"{}\": [{}, {}, {}, {}, {}, {}]\n", joint.name, home[0],
                                home[1], home[2], home[3], home[4], home[5]);
        continue;
      }
      for (const UrdfStep& step : UrdfSteps(joint, m_.tree_reversed[t])) {
        if (step.coordinate < 0) continue;
        guesses_ += fmt::format("    \"{}\": {}\n", step.name, joint.home[step.coordinate]);
      }
    }
  }

  [[nodiscard]] std::string CompensationText() const {
    std::string text;
    for (const Body& body : m_.bodies) {
      if (body.gravity_compensation == 0.0) continue;
      text += fmt::format("    \"{}\": {}\n", body.name, body.gravity_compensation);
    }
    return text.empty() ? "" : "  gravity_compensation:\n" + text;
  }

  void WriteClosures() {
    for (size_t j = 0; j < m_.joints.size(); ++j) {
      const Joint& joint = m_.joints[j];
      if (!joint.closure) continue;
      const std::string name = YamlName(joint.name);
      const auto contact = std::ranges::find(m_.contacts, static_cast<int>(j), &Contact::joint);
      if (contact != m_.contacts.end()) {
        const std::string foot = Attach(joint.child, name + "_foot", joint.X_CM);
        const std::string ground = Attach(joint.parent, name + "_ground", joint.X_PF);
        sections_["contacts"] += fmt::format("  {}: {{on: {}, to: {}, {}}}\n", name, foot, ground,
                                             internal::ContactText(*contact));
        continue;
      }
      std::string line =
          fmt::format("  {}: {{kind: {}, parent: {}, child: {}", name, WordOf(joint.kind),
                      Attach(joint.parent, name + "_parent", joint.X_PF),
                      Attach(joint.child, name + "_child", joint.X_CM));
      const int axes = RowOf(joint.kind).axes;
      if (axes > 0) line += ", axis: " + List(joint.axis);
      if (axes > 1) line += ", axis2: " + List(joint.axis2);
      const int n = DofsOf(joint.kind);
      std::string guess, range;
      bool limited = false;
      for (int k = 0; k < n; ++k) {
        guess += fmt::format("{}{}", k == 0 ? "" : ", ", joint.home[k]);
        range += (k == 0 ? "" : ", ") + RangeText(joint.range[k]);
        limited = limited || IsLimited(joint.range[k]);
      }
      if (n > 0) line += ", guess: [" + guess + "]";
      if (limited) line += ", range: [" + range + "]";
      if (std::isfinite(joint.max_rotation)) {
        line += fmt::format(", range: [0, {}]", joint.max_rotation);
      }
      if (joint.transmits_force_only) line += ", transmits: force";
      sections_["joints"] += line + ", closure: true}\n";
    }
  }

  // Name of the URDF or closure joint that has this coordinate, and the coordinate there.
  std::pair<std::string, int> FindCoordinate(int joint_index, int coordinate) const {
    const Joint& joint = m_.joints[joint_index];
    if (joint.closure) return {YamlName(joint.name), coordinate};
    for (const UrdfStep& step : UrdfSteps(joint, false)) {
      if (step.coordinate == coordinate) return {step.name, 0};
    }
    return {joint.name, coordinate};  // floating
  }

  void WriteDrives() {
    for (const Drive& drive : m_.drives) {
      const std::string name = YamlName(drive.name);
      std::string line = "  " + name + ": {";
      if (const auto* on_joint = std::get_if<JointDrive>(&drive.kind)) {
        const auto [joint, coordinate] = FindCoordinate(on_joint->joint, on_joint->coordinate);
        line += fmt::format("kind: joint, joint: \"{}\", coordinate: {}", joint, coordinate);
      } else {
        const auto& line_drive = std::get<DistanceDrive>(drive.kind);
        line += fmt::format("kind: distance, from: {}, to: {}",
                            AttachPoint(line_drive.body_from, name + "_from", line_drive.p_from),
                            AttachPoint(line_drive.body_to, name + "_to", line_drive.p_to));
        if (drive.radius > 0.0) line += fmt::format(", radius: {}", drive.radius);
      }
      if (IsLimited(drive.range)) line += ", range: " + RangeText(drive.range);
      if (drive.compensates_gravity) line += ", gravity_compensation: true";
      sections_["drives"] += line + "}\n";
    }
    for (const Motor& motor : m_.motors) {
      sections_["motors"] +=
          fmt::format("  {}: {{{}}}\n", YamlName(m_.drives[static_cast<size_t>(motor.drive)].name),
                      MotorText(motor));
    }
  }

  void WriteRest() {
    for (const Prescribed& prescribed : m_.prescribed) {
      sections_["prescribed"] += fmt::format("  {}: {{joint: \"{}\"}}\n", YamlName(prescribed.name),
                                             FindCoordinate(prescribed.joint, 0).first);
    }
    for (const Output& output : m_.outputs) {
      const std::string name = YamlName(output.name);
      const std::string frame = Attach(output.body, "output_" + name, output.X_BO);
      const std::string in = Attach(output.reference_body, "reference_" + name, output.X_RbR);
      sections_["outputs"] += fmt::format("  {}: {{frame: {}, in: {}}}\n", name, frame, in);
    }
    for (const Coupling& coupling : m_.couplings) {
      sections_["couplings"] +=
          fmt::format("  {}: {{{}}}\n", YamlName(coupling.name),
                      CouplingText(coupling, [this](const Coupling::Term& term) {
                        const auto [joint, k] = FindCoordinate(term.joint, term.coordinate);
                        return std::pair('"' + joint + '"', k);
                      }));
    }
    for (size_t b = 0; b < m_.bushings.size(); ++b) WriteBushing(b);
    for (const ForceElement& element : m_.elements) {
      if (element.bushing >= 0 || IsUrdfDynamics(m_, element)) continue;
      if (!IsFurtherOfBall(m_, element)) WriteElement(element);
    }
    for (const SpringDamper& s : m_.springs) {
      const std::string name = YamlName(s.name);
      sections_["springs"] += fmt::format(
          "  {}: {{from: {}, to: {}, stiffness: {}, damping: {}, free_length: {}}}\n", name,
          AttachPoint(s.body_from, name + "_from", s.p_from),
          AttachPoint(s.body_to, name + "_to", s.p_to), s.stiffness, s.damping, s.free_length_m);
    }
  }

  void WriteBushing(size_t b) {
    const Bushing& bushing = m_.bushings[b];
    const std::string name = YamlName(bushing.name);
    const std::string parent = Attach(bushing.parent, name + "_F", bushing.X_PF);
    const std::string child = Attach(bushing.child, name + "_M", bushing.X_CM);
    sections_["elements"] +=
        fmt::format("  {}: {{{}}}\n", name, BushingText(m_, static_cast<int>(b), parent, child));
  }

  void WriteElement(const ForceElement& element) {
    std::string place;
    if (element.drive >= 0) {
      place = "drive: " + YamlName(m_.drives[static_cast<size_t>(element.drive)].name);
    } else if (element.spring >= 0) {
      place = "spring: " + YamlName(m_.springs[static_cast<size_t>(element.spring)].name);
    } else {
      const auto [joint, k] = FindCoordinate(element.joint, element.coordinate);
      place = fmt::format("joint: \"{}\"{}", joint,
                          ActsOnBall(m_, element) ? kRotationText : CoordinateText(k));
    }
    const auto* friction = std::get_if<FrictionLaw>(&element.law);
    if (friction != nullptr && friction->coupling >= 0) {
      place +=
          ", coupling: " + YamlName(m_.couplings[static_cast<size_t>(friction->coupling)].name);
    }
    if (IsGyroscopic(element)) {
      const RotorAxis& axis = *std::get<RotorLaw>(element.law).carrier;
      Pose X = Pose::Identity();
      X.linear() = LeastRotation(Vec3::UnitZ(), axis.axis_B);
      const std::string frame = Attach(axis.body, YamlName(FileName(m_, element)) + "_axis", X);
      place += CarrierText({.body = axis.body, .axis_B = Vec3::UnitZ()}, frame);
    }
    sections_["elements"] += fmt::format("  {}: {{{}}}\n", YamlName(FileName(m_, element)),
                                         ElementText(element, place, ActsOnLength(m_, element)));
  }

  const Mechanism m_;
  std::vector<Pose> link_frames_;
  std::string guesses_;
  std::map<int, std::string> attached_;
  std::map<std::string, std::string> sections_;
};

}  // namespace

std::string WriteUrdfCompanion(const Mechanism& mechanism, const std::string& urdf_file,
                               const std::vector<ModelCaveat>& caveats) {
  return Companion(mechanism).Text(urdf_file) + LeftOutText(caveats);
}

std::string UrdfCompanionPath(const std::string& urdf_file) {
  return std::filesystem::path(urdf_file).replace_extension(".mbverify.yaml").string();
}

}  // namespace mbv
