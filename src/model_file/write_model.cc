#include "model_file/write_model.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>

#include "base/files.h"
#include "mechanism/reach.h"
#include "model_file/catalogue.h"
#include "model_file/element_text.h"
#include "model_file/mesh/read_mesh.h"
#include "model_file/model_contacts.h"
#include "model_file/model_drives.h"

namespace mbv {
namespace {

constexpr size_t kLongestModelName = 64;

// A name that model files take, unlike all in `taken`.
std::string FreshName(const std::string& name, std::set<std::string>* taken) {
  std::string plain;
  for (const char c : name) {
    const auto u = static_cast<unsigned char>(c);
    plain += u < 0x80 && (std::isalnum(u) != 0 || c == '_' || c == '-') ? c : '_';
  }
  if (plain.empty() || plain == "null" || plain == "Null" || plain == "NULL") plain += "_";
  plain.resize(std::min(plain.size(), kLongestModelName - 4));
  std::string fresh = plain;
  for (int i = 2; !taken->insert(fresh).second; ++i) fresh = fmt::format("{}_{}", plain, i);
  return fresh;
}

template <typename T>
std::vector<std::string> FreshNames(const std::vector<T>& items, std::set<std::string>* taken) {
  std::vector<std::string> names;
  names.reserve(items.size());
  for (const T& item : items) names.push_back(FreshName(item.name, taken));
  return names;
}

std::string Triple(const Vec3& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); }

std::string RangePair(const CoordinateRange& range) {
  const auto bound = [](double x) { return std::isfinite(x) ? fmt::format("{}", x) : "null"; };
  return fmt::format("[{}, {}]", bound(range.lower), bound(range.upper));
}

bool HasBound(const CoordinateRange& range) {
  return std::isfinite(range.lower) || std::isfinite(range.upper);
}

bool IsIdentity(const Pose& X) { return X.matrix() == Pose::Identity().matrix(); }

std::string PoseText(const Pose& X) {
  if (X.linear() == Mat3::Identity()) return Triple(X.translation());
  const Mat3 R = X.linear();
  return fmt::format("{{position: {}, rotation: {{matrix: [{}, {}, {}]}}}}",
                     Triple(X.translation()), Triple(R.row(0)), Triple(R.row(1)), Triple(R.row(2)));
}

struct ShapeText {
  std::filesystem::path folder;  // of the model
  std::string operator()(const Capsule& s) const { return Rod("capsule", s); }
  std::string operator()(const Cylinder& s) const { return Rod("cylinder", s); }
  std::string operator()(const Box& s) const {
    return fmt::format("box: {{size: {}, at: {}}}", Triple(s.size), PoseText(s.X_BG));
  }
  std::string operator()(const Ball& s) const {
    return fmt::format("ball: {{at: {}, radius: {}}}", Triple(s.p_centre), s.radius);
  }
  std::string operator()(const Mesh& s) const {
    const bool even = (s.scale.array() == s.scale.x()).all();
    return fmt::format("mesh: {{file: {}, scale: {}, at: {}}}",
                       QuotedYaml(PathSeenFrom(folder, s.file)),
                       even ? fmt::format("{}", s.scale.x()) : Triple(s.scale), PoseText(s.X_BG));
  }
  template <typename T>
  static std::string Rod(const char* word, const T& s) {
    return fmt::format("{}: {{from: {}, to: {}, radius: {}}}", word, Triple(s.p_from),
                       Triple(s.p_to), s.radius);
  }
};

class ModelWriter {
 public:
  explicit ModelWriter(const Mechanism& mechanism)
      : m_(mechanism), names_(NamesInModel(mechanism)), frames_(mechanism.bodies.size()) {
    for (size_t b = 0; b < m_.bodies.size(); ++b) {
      for (const NamedFrame& frame : m_.bodies[b].frames) {
        AddFrame(static_cast<int>(b), frame.name, frame.X_BF);
      }
    }
  }

  std::string Text() {
    // What refers to frames comes first, because it adds them.
    const std::string joints = Joints(), rest = Drives() + Others();
    std::string text = "name: " + ModelName() + "\n";
    if (!m_.description.empty()) text += "description: " + QuotedYaml(m_.description) + "\n";
    text += "gravity: " + Triple(m_.gravity_W) + "\n";
    const double g = m_.gravity_W.norm();
    if (!(g > 0.0) || !(m_.up_W + m_.gravity_W / g).isZero(1e-12)) {
      text += "up: " + Triple(m_.up_W) + "\n";
    }
    if (!frames_[0].lines.empty() || !m_.bodies[0].shapes.empty()) {
      text += "world:\n" + FramesAndShapes(0, "  ");
    }
    const bool impossible = std::ranges::any_of(
        m_.bodies, [](const Body& body) { return !ImpossibleInertia(body).empty(); });
    if (impossible) text += "allow: impossible_inertia\n";
    text += "bodies:\n";
    for (size_t b = 1; b < m_.bodies.size(); ++b) text += BodyText(b);
    return text + joints + rest;
  }

 private:
  struct Frames {
    std::set<std::string> names;
    std::vector<std::pair<std::string, Pose>> lines;
  };

  std::string ModelName() const {
    const std::string name = NearestName(m_.name);
    return name.empty() ? "mechanism" : name;
  }

  std::string AddFrame(int body, const std::string& name, const Pose& X) {
    Frames& frames = frames_[body];
    frames.lines.emplace_back(FreshName(name, &frames.names), X);
    return frames.lines.back().first;
  }

  // "BODY" or "BODY.FRAME" for a pose on a body.
  std::string Ref(int body, const Pose& X, const std::string& wish) {
    if (body != 0 && IsIdentity(X)) return names_.bodies[body];
    for (const auto& [name, known] : frames_[body].lines) {
      if (known.matrix() == X.matrix()) return names_.bodies[body] + "." + name;
    }
    return names_.bodies[body] + "." + AddFrame(body, wish, X);
  }
  std::string PointRef(int body, const Vec3& p, const std::string& wish) {
    Pose X = Pose::Identity();
    X.translation() = p;
    return Ref(body, X, wish);
  }

  std::string FramesAndShapes(int body, const std::string& indent) const {
    std::string text;
    if (!frames_[body].lines.empty()) text += indent + "frames:\n";
    for (const auto& [name, X] : frames_[body].lines) {
      text += fmt::format("{}  {}: {}\n", indent, name, PoseText(X));
    }
    const ShapeText writer{std::filesystem::path(m_.file).parent_path()};
    if (!m_.bodies[body].shapes.empty()) text += indent + "shapes:\n";
    for (const Shape& shape : m_.bodies[body].shapes) {
      text += fmt::format("{}  - {{{}, color: {}}}\n", indent, std::visit(writer, shape.geometry),
                          QuotedYaml(shape.color));
    }
    return text;
  }

  std::string BodyText(size_t b) const {
    const Body& body = m_.bodies[b];
    std::string text = "  " + names_.bodies[b] + ":\n";
    const Mat3& I = body.I_Bcm_B;
    text += fmt::format("    mass: {}\n", body.mass);
    if (body.mass != 0.0 || !I.isZero(0.0)) {
      text += fmt::format(
          "    com: {}\n    inertia: {{xx: {}, yy: {}, zz: {}, xy: {}, xz: {}, yz: {}}}\n",
          Triple(body.p_BoBcm_B), I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2));
    }
    if (body.gravity_compensation != 0.0) {
      text += fmt::format("    gravity_compensation: {}\n", body.gravity_compensation);
    }
    return text + FramesAndShapes(static_cast<int>(b), "    ");
  }

  std::string Joints() {
    std::string text = "joints:\n";
    for (size_t j = 0; j < m_.joints.size(); ++j) {
      const Joint& joint = m_.joints[j];
      const std::string& name = names_.joints[j];
      if (std::ranges::any_of(m_.contacts, [&](const Contact& contact) {
            return contact.joint == static_cast<int>(j);
          })) {
        continue;  // it is written as a contact
      }
      text += fmt::format("  {}: {{kind: {}, parent: {}, child: {}", name, WordOf(joint.kind),
                          Ref(joint.parent, joint.X_PF, name + "_F"),
                          Ref(joint.child, joint.X_CM, name + "_M"));
      const int axes = RowOf(joint.kind).axes;
      if (axes > 0) text += ", axis: " + Triple(joint.axis);
      if (axes > 1) text += ", axis2: " + Triple(joint.axis2);
      text += GuessAndRange(joint);
      if (joint.transmits_force_only) text += ", transmits: force";
      if (joint.closure) text += ", closure: true";
      text += "}\n";
    }
    return m_.joints.empty() ? "" : text;
  }

  static std::string GuessAndRange(const Joint& joint) {
    const int n = DofsOf(joint.kind);
    std::string guess, range;
    bool limited = false;
    for (int k = 0; k < n; ++k) {
      guess += fmt::format("{}{}", k == 0 ? "" : ", ", joint.home[k]);
      range += (k == 0 ? "" : ", ") + RangePair(joint.range[k]);
      limited = limited || HasBound(joint.range[k]);
    }
    std::string text;
    if (n == 1) text = ", guess: " + guess + (limited ? ", range: " + range : "");
    if (n > 1) text = ", guess: [" + guess + "]" + (limited ? ", range: [" + range + "]" : "");
    if (std::isfinite(joint.max_rotation)) {
      text += fmt::format(", range: [0, {}]", joint.max_rotation);
    }
    return text;
  }

  std::string Drives() {
    std::string text = "drives:\n";
    for (size_t d = 0; d < m_.drives.size(); ++d) {
      const Drive& drive = m_.drives[d];
      const std::string& name = names_.drives[d];
      text += "  " + name + ": {";
      if (const auto* on_joint = std::get_if<JointDrive>(&drive.kind)) {
        text += "kind: joint, joint: " + names_.joints[on_joint->joint];
        if (on_joint->coordinate != 0) {
          text += fmt::format(", coordinate: {}", on_joint->coordinate);
        }
      } else {
        const auto& leg = std::get<DistanceDrive>(drive.kind);
        text += fmt::format("kind: distance, from: {}, to: {}",
                            PointRef(leg.body_from, leg.p_from, name + "_from"),
                            PointRef(leg.body_to, leg.p_to, name + "_to"));
        if (drive.radius > 0.0) text += fmt::format(", radius: {}", drive.radius);
      }
      if (HasBound(drive.range)) text += ", range: " + RangePair(drive.range);
      if (std::isfinite(drive.stiffness)) text += fmt::format(", stiffness: {}", drive.stiffness);
      if (drive.compensates_gravity) text += ", gravity_compensation: true";
      text += "}\n";
    }
    std::string symbols;
    for (size_t d = 0; d < m_.drives.size(); ++d) {
      if (m_.drives[d].symbol.empty()) continue;
      symbols += fmt::format("  {}: {}\n", names_.drives[d], QuotedYaml(m_.drives[d].symbol));
    }
    if (!symbols.empty()) text += "symbols:\n" + symbols;
    return m_.drives.empty() ? "" : text;
  }

  std::string Others() {
    std::string text;
    if (!m_.prescribed.empty()) text += "prescribed:\n";
    std::set<std::string> taken;
    for (const Prescribed& p : m_.prescribed) {
      text +=
          fmt::format("  {}: {{joint: {}}}\n", FreshName(p.name, &taken), names_.joints[p.joint]);
    }
    if (!m_.outputs.empty()) text += "outputs:\n";
    for (size_t o = 0; o < m_.outputs.size(); ++o) {
      const Output& output = m_.outputs[o];
      const std::string& name = names_.outputs[o];
      text +=
          fmt::format("  {}: {{frame: {}, in: {}}}\n", name, Ref(output.body, output.X_BO, name),
                      Ref(output.reference_body, output.X_RbR, name + "_in"));
    }
    if (!m_.couplings.empty()) text += "couplings:\n";
    for (const Coupling& coupling : m_.couplings) {
      coupling_names_.push_back(FreshName(coupling.name, &taken));
      text += fmt::format("  {}: {{{}}}\n", coupling_names_.back(),
                          CouplingText(coupling, [this](const Coupling::Term& term) {
                            return std::pair(names_.joints[term.joint], term.coordinate);
                          }));
    }
    for (const SpringDamper& s : m_.springs) spring_names_.push_back(FreshName(s.name, &taken));
    if (!m_.elements.empty()) text += "elements:\n";
    for (size_t b = 0; b < m_.bushings.size(); ++b) text += Written(b, &taken);
    for (const ForceElement& element : m_.elements) {
      if (element.bushing >= 0 || IsFurtherOfBall(m_, element)) continue;
      text +=
          fmt::format("  {}: {{{}}}\n", FreshName(FileName(m_, element), &taken),
                      ElementText(element, PlaceOf(element) + Carrier(element) + Geared(element),
                                  ActsOnLength(m_, element)));
    }
    if (!m_.springs.empty()) text += "springs:\n";
    for (const SpringDamper& s : m_.springs) {
      const std::string& name = spring_names_[static_cast<size_t>(&s - m_.springs.data())];
      text += fmt::format(
          "  {}: {{from: {}, to: {}, stiffness: {}, damping: {}, free_length: {}}}\n", name,
          PointRef(s.body_from, s.p_from, name + "_from"),
          PointRef(s.body_to, s.p_to, name + "_to"), s.stiffness, s.damping, s.free_length_m);
    }
    text += Contacts();
    if (!m_.motors.empty()) text += "motors:\n";
    for (const Motor& motor : m_.motors) {
      text += fmt::format("  {}: {{{}}}\n", names_.drives[static_cast<size_t>(motor.drive)],
                          MotorText(motor));
    }
    if (m_.dc_link) text += fmt::format("dc_link: {{{}}}\n", internal::DcLinkText(*m_.dc_link));
    return text;
  }

  // Feet that hold, where they are on the ground.
  std::string Contacts() {
    std::string text;
    for (const Contact& contact : m_.contacts) {
      if (contact.joint < 0) continue;
      const Joint& joint = m_.joints[static_cast<size_t>(contact.joint)];
      const std::string& name = names_.joints[static_cast<size_t>(contact.joint)];
      text += fmt::format(
          "  {}: {{on: {}, to: {}, {}}}\n", name, Ref(joint.child, joint.X_CM, name + "_foot"),
          Ref(joint.parent, joint.X_PF, name + "_ground"), internal::ContactText(contact));
    }
    return text.empty() ? "" : "contacts:\n" + text;
  }

  std::string Written(size_t b, std::set<std::string>* taken) {
    const Bushing& bushing = m_.bushings[b];
    const std::string name = FreshName(bushing.name, taken);
    return fmt::format(
        "  {}: {{{}}}\n", name,
        BushingText(m_, static_cast<int>(b), Ref(bushing.parent, bushing.X_PF, name + "_F"),
                    Ref(bushing.child, bushing.X_CM, name + "_M")));
  }

  // Where the bearings of a rotor are.
  [[nodiscard]] std::string Carrier(const ForceElement& element) const {
    if (!IsGyroscopic(element)) return "";
    const RotorAxis& axis = *std::get<RotorLaw>(element.law).carrier;
    return CarrierText(axis, names_.bodies[static_cast<size_t>(axis.body)]);
  }

  // The coupling whose force friction follows.
  [[nodiscard]] std::string Geared(const ForceElement& element) const {
    const auto* friction = std::get_if<FrictionLaw>(&element.law);
    if (friction == nullptr || friction->coupling < 0) return "";
    return ", coupling: " + coupling_names_[static_cast<size_t>(friction->coupling)];
  }

  [[nodiscard]] std::string PlaceOf(const ForceElement& element) const {
    if (element.drive >= 0) return "drive: " + names_.drives[element.drive];
    if (element.spring >= 0) return "spring: " + spring_names_[element.spring];
    return fmt::format(
        "joint: {}{}", names_.joints[element.joint],
        ActsOnBall(m_, element) ? kRotationText : CoordinateText(element.coordinate));
  }

  const Mechanism& m_;
  const WrittenNames names_;
  std::vector<Frames> frames_;
  std::vector<std::string> spring_names_, coupling_names_;
};

}  // namespace

std::string QuotedYaml(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n') {
      quoted += "\\n";
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

std::string ForeignModelText(Mechanism mechanism) {
  mechanism.name = NearestName(mechanism.name);
  if (mechanism.name.empty()) mechanism.name = "robot";
  return WriteModel(mechanism);
}

WrittenNames NamesInModel(const Mechanism& mechanism) {
  WrittenNames names;
  std::set<std::string> bodies = {}, joints, signals;
  names.bodies = FreshNames(mechanism.bodies, &bodies);
  names.joints = FreshNames(mechanism.joints, &joints);
  names.drives = FreshNames(mechanism.drives, &signals);
  names.outputs = FreshNames(mechanism.outputs, &signals);
  return names;
}

std::string WriteModel(const Mechanism& mechanism, const std::vector<ModelCaveat>& caveats) {
  return ModelWriter(mechanism).Text() + LeftOutText(caveats);
}

std::string LeftOutText(const std::vector<ModelCaveat>& caveats) {
  const auto left_out = TextsOf(caveats, ModelCaveat::Kind::kLeftOut);
  std::string text = left_out.empty() ? "" : "left_out:\n";
  for (const std::string& each : left_out) text += "  - " + QuotedYaml(each) + "\n";
  return text;
}

namespace {

// "meshes/NAME.stl" with a name near that of the file, each once.
std::string MeshPath(const std::string& file, std::set<std::string>* taken) {
  std::string name = NearestName(std::filesystem::path(file).stem().string());
  if (name.empty()) name = "mesh";
  std::string fresh = name;
  for (int i = 2; !taken->insert(fresh).second; ++i) fresh = fmt::format("{}_{}", name, i);
  return "meshes/" + fresh + ".stl";
}

}  // namespace

std::vector<ModelMeshFile> TakeMeshesAlong(Mechanism* mechanism) {
  std::vector<ModelMeshFile> files;
  std::map<const TriangleMesh*, std::string> known;
  std::set<std::string> taken;
  for (Body& body : mechanism->bodies) {
    for (Shape& shape : body.shapes) {
      auto* mesh = std::get_if<Mesh>(&shape.geometry);
      if (mesh == nullptr) continue;
      std::string& path = known[mesh->surface.get()];
      if (path.empty()) {
        path = MeshPath(mesh->file, &taken);
        files.push_back({path, ToStl(*mesh->surface, mechanism->name + ", metres")});
      }
      mesh->file = path;
      mesh->scale = Vec3::Ones();
    }
  }
  mechanism->file.clear();
  return files;
}

}  // namespace mbv
