// The model.yaml that completes an exported URDF file.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/parallel_transport.h"
#include "core/spatial.h"
#include "mechanism/joint_pose.h"
#include "model_file/element_text.h"
#include "model_file/urdf.h"
#include "model_file/urdf_frames.h"
#include "model_file/write_model.h"

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
    std::string text = fmt::format(
        "name: {}\nurdf:\n  file: \"{}\"\n  constraints: false\n  guess:\n{}gravity: {}\n",
        YamlName(m_.name), urdf_file, guesses_, List(m_.gravity_W));
    text += "attach:\n";
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

  void WriteClosures() {
    for (const Joint& joint : m_.joints) {
      if (!joint.closure) continue;
      const std::string name = YamlName(joint.name);
      std::string line =
          fmt::format("  {}: {{kind: {}, parent: {}, child: {}", name, WordOf(joint.kind),
                      Attach(joint.parent, name + "_parent", joint.X_PF),
                      Attach(joint.child, name + "_child", joint.X_CM));
      const int axes = RowOf(joint.kind).axes;
      if (axes > 0) line += ", axis: " + List(joint.axis);
      if (axes > 1) line += ", axis2: " + List(joint.axis2);
      const int n = FreedomsOf(joint.kind);
      std::string guess, range;
      bool limited = false;
      for (int k = 0; k < n; ++k) {
        guess += fmt::format("{}{}", k == 0 ? "" : ", ", joint.home[k]);
        range += (k == 0 ? "" : ", ") + RangeText(joint.range[k]);
        limited = limited || IsLimited(joint.range[k]);
      }
      if (n > 0) line += ", guess: [" + guess + "]";
      if (limited) line += ", range: [" + range + "]";
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
      sections_["drives"] += line + "}\n";
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
      if (element.bushing < 0 && !IsUrdfDynamics(m_, element)) WriteElement(element);
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
    } else {
      const auto [joint, k] = FindCoordinate(element.joint, element.coordinate);
      place = fmt::format("joint: \"{}\"{}", joint, CoordinateText(k));
    }
    if (IsGyroscopic(element)) {
      const RotorAxis& axis = *std::get<RotorLaw>(element.law).carrier;
      Pose X = Pose::Identity();
      X.linear() = LeastRotation(Vec3::UnitZ(), axis.axis_B);
      const std::string frame = Attach(axis.body, YamlName(element.name) + "_axis", X);
      place += CarrierText({.body = axis.body, .axis_B = Vec3::UnitZ()}, frame);
    }
    sections_["elements"] += fmt::format("  {}: {{{}}}\n", YamlName(element.name),
                                         ElementText(element, place, ActsOnLength(m_, element)));
  }

  const Mechanism m_;
  std::vector<Pose> link_frames_;
  std::string guesses_;
  std::map<int, std::string> attached_;
  std::map<std::string, std::string> sections_;
};

}  // namespace

std::string WriteUrdfCompanion(const Mechanism& mechanism, const std::string& urdf_file) {
  return Companion(mechanism).Text(urdf_file);
}

}  // namespace mbv
