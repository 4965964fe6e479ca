#include "model_file/urdf_closures.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <cmath>
#include <optional>
#include <sstream>

#include "core/parallel_transport.h"
#include "core/spatial.h"
#include "core/text.h"

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
      Error(element,
            fmt::format("{}: type = '{}' is no kind of closure", Where(element), type ? type : ""),
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

// Closures and gears that mbverify does not read, but that must not be lost silently.
void WarnOfOthers(const XMLElement& element, const std::string& file, Diagnostics* diagnostics) {
  const std::string tag = element.Name();
  const auto warn = [&](const std::string& text, const std::string& hint) {
    diagnostics->Add({Severity::kWarning, file, element.GetLineNum(), 1, text, hint});
  };
  if (tag == "gazebo" && element.FirstChildElement("joint") != nullptr) {
    warn("a joint inside <gazebo> is left out",
         "if it closes a loop, state it as <constraint> or under `joints` of the model file");
  } else if (tag == "coupling") {
    warn("<coupling> is left out: there are no gears between joints here",
         "drive both joints and couple them by `equal` in the scenario");
  } else if (tag == "transmission") {
    WarnOfReduction(element, element.Attribute("name"), file, diagnostics);
  }
}

std::string Numbers(const Vec3& v) {
  return fmt::format("{} {} {}", v.x() + 0.0, v.y() + 0.0, v.z() + 0.0);
}

std::string Escaped(const std::string& text) {
  tinyxml2::XMLPrinter printer(nullptr, true);
  printer.PushText(text.c_str());
  return printer.CStr();
}

}  // namespace

UrdfDetails ReadUrdfDetails(const std::string& text, const std::string& file,
                            Diagnostics* diagnostics) {
  UrdfDetails details;
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) return details;
  const XMLElement* robot = document.FirstChildElement("robot");
  if (robot == nullptr) return details;
  ClosureReader reader(file, diagnostics);
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
    WarnOfOthers(*e, file, diagnostics);
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
