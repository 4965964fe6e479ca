#include "model_file/model_urdf.h"

#include <fmt/format.h>
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/text.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "model_file/urdf/urdf_import.h"

namespace mbv::internal {
namespace {

// Links that are frames: exporters write a frame as a link of next to no mass, held by a fixed
// joint. Internal to the URDF reader.

/// A link below this share of the robot's mass is a frame, or a massless connecting piece.
inline constexpr double kNegligibleShare = 1e-6;
/// A link without inertia, fixed to another one, counts as a mass point below this share.
inline constexpr double kPointMassShare = 1e-3;
constexpr double kInertiaRoundoff = 1e-12;  // of the terms of a sum

void AddMass(const Body& part, const Pose& X_BP, Body* body) {
  if (part.mass == 0.0 && part.I_Bcm_B.isZero(0.0)) return;
  const double mass = body->mass + part.mass;
  const Vec3 p_part = X_BP * part.p_BoBcm_B;
  Vec3 p = 0.5 * (body->p_BoBcm_B + p_part);
  if (mass > 0.0) p = (body->mass * body->p_BoBcm_B + part.mass * p_part) / mass;
  // Steiner's terms of both about the new centre of mass.
  const double before = body->I_Bcm_B.norm();
  const Mat3 C_body = Skew(body->p_BoBcm_B - p), C_part = Skew(p_part - p);
  body->I_Bcm_B += X_BP.linear() * part.I_Bcm_B * X_BP.linear().transpose() -
                   body->mass * C_body * C_body - part.mass * C_part * C_part;
  // Mass points that coincide leave round-off.
  const double size = part.mass * C_part.squaredNorm() + body->mass * C_body.squaredNorm() +
                      part.I_Bcm_B.norm() + before;
  if (body->I_Bcm_B.norm() < kInertiaRoundoff * size) body->I_Bcm_B.setZero();
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
  /// `bare`: no model file gives masses, or names joints.
  Folder(const std::set<std::string>& keep, const std::vector<std::string>& motors, bool bare,
         UrdfTree* tree)
      : keep_(keep), motors_(motors), bare_(bare), tree_(*tree) {
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
    if (joint_of_[b] < 0 || HasInertia(body) || !IsNegligible(body)) return;
    if (body.mass == 0.0 && !bare_) return;
    Joint& joint = tree_.joints[joint_of_[b]];
    if (joint.kind == JointKind::kFixed || Contains(motors_, joint.name)) return;
    const bool is_coupled = std::ranges::any_of(tree_.mimics, [&](const UrdfTree::Mimic& mimic) {
      return mimic.joint == joint.name || mimic.of == joint.name;
    });
    if (is_coupled) return;
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
  const bool bare_;
  UrdfTree& tree_;
  double total_kg_ = 0.0;
  std::vector<int> carrier_;   // per link: itself, the link that carries it, or -1: the world
  std::vector<Pose> X_CL_;     // per link: its frame in its carrier
  std::vector<int> joint_of_;  // per link: the joint that carries it, or -1
  std::vector<std::string> joined_, heavier_, points_, frozen_, massless_;
  double joined_kg_ = 0.0, massless_kg_ = 0.0;
};

// Makes links that are frames frames of the body that carries them, mass and inertia included:
//
//   * on a fixed joint, with negligible mass, or without inertia and light: joined to their
//     carrier, which gets a frame of the link's name; so are chains of them. Joints and closures
//     on them go over to the carrier; the fixed joint is gone;
//   * on a moving joint, with negligible mass and without inertia: massless connecting pieces; at
//     the end of a chain, with nothing that holds or drives them, frames as well.
//
// Links named in `keep` stay bodies. What was done is one warning; what really matters and lacks
// inertia is left for the checks to name. `UrdfTree::frames` lists where each link went.
void FoldFrameLinks(const std::set<std::string>& keep, const std::vector<std::string>& motors,
                    bool bare, const std::string& file, UrdfTree* tree, Diagnostics* diagnostics) {
  Folder folder(keep, motors, bare, tree);
  folder.Run();
  folder.Report(file, diagnostics);
}

}  // namespace
UrdfSection UrdfReader::Read(const Block& model, const YamlNode& node, const Into& into) {
  YamlReader& yaml = values_.yaml();
  const bool short_form = node.is_scalar();
  const YamlMap map(
      &yaml, short_form ? nullptr : &node, "urdf",
      {"file", "closures", "constraints", "guess", "guess_deg", "gravity_compensation"});
  const YamlNode* name = short_form ? &node : map.Required("file");
  into.joints->good = false;  // until the tree is read
  const auto source = name == nullptr ? std::nullopt : ReadSource(model, *name, map);
  if (!source) return {};
  if (!HasRoom(node, source->tree.bodies.size(), kMaxBodies + 1, "bodies", &yaml)) return {};
  into.joints->good = true;
  UrdfSection urdf = Add(*source, into.bodies, into.joints);
  urdf.left_out = source->tree.left_out;
  urdf.gravity_W = source->tree.gravity_W;
  urdf.motors = source->tree.motors;
  ReadGuesses(model, map, into.joints);
  ReadCompensation(model, map, into.bodies);
  AddMimics(source->tree, node, into);
  AddDynamics(source->tree, into);
  AddExtras(source->tree, into);
  // The model file's own drives are the better ones.
  if (model.Section("drives") == nullptr) AddDrives(MotorsOf(*source, *into.joints), node, into);
  return urdf;
}

std::optional<UrdfReader::Source> UrdfReader::ReadSource(const Block& model, const YamlNode& name,
                                                         const YamlMap& map) {
  YamlReader& yaml = values_.yaml();
  const auto file = yaml.Text(name, "urdf");
  if (!file) return std::nullopt;
  const std::filesystem::path path = std::filesystem::path(yaml.file()).parent_path() / *file;
  YamlReader reader(path.string());
  const auto text = reader.ReadFile();
  if (!text) {
    yaml.Error(name, fmt::format("urdf = {} cannot be read", Describe(name)),
               "the path is relative to this file");
    return std::nullopt;
  }
  Diagnostics findings;
  Source source{
      .file = path.string(), .tree = ReadUrdf(*text, path.string(), &findings), .motors = {}};
  others_.Append(findings);
  if (findings.has_errors()) return std::nullopt;
  if (const YamlNode* constraints = map.Find("constraints")) {
    if (!yaml.Flag(*constraints, map.PathOf("constraints")).value_or(true)) {
      DropClosures(&source.tree);
    }
  }
  const YamlNode* closures = map.Find("closures");
  if (closures != nullptr &&
      !ReadClosureFile(*closures, &yaml, &others_, &source.tree, &source.motors)) {
    return std::nullopt;
  }
  std::set<std::string> keep;  // bodies that the model file writes on
  if (const YamlNode* attach = model.Section("attach")) {
    for (const YamlEntry& entry : attach->entries) keep.insert(entry.key);
  }
  FoldFrameLinks(keep, source.motors, bare_, source.file, &source.tree, &others_);
  return source;
}

void UrdfReader::TakeLiterals(Body* body) {
  const std::string place = "urdf." + body->name;
  body->mass = literals_.At(place + ".mass", body->mass);
  for (int row = 0; row < 3; ++row) {
    body->p_BoBcm_B[row] =
        literals_.At(fmt::format("{}.com[{}]", place, row), body->p_BoBcm_B[row]);
    for (int col = row; col < 3; ++col) {
      const std::string key = {"xyz"[row], "xyz"[col]};
      const double value = literals_.At(place + ".inertia." + key, body->I_Bcm_B(row, col));
      body->I_Bcm_B(row, col) = body->I_Bcm_B(col, row) = value;
    }
  }
}

UrdfSection UrdfReader::Add(const Source& source, ModelBodies* bodies, ModelJoints* joints) {
  const UrdfTree& tree = source.tree;
  const int first = static_cast<int>(bodies->bodies.size());
  for (size_t b = 0; b < tree.bodies.size(); ++b) {
    bodies->bodies.push_back(tree.bodies[b]);
    TakeLiterals(&bodies->bodies.back());
    const int line = tree.body_lines[b];
    bodies->places.push_back(
        {.place = {},
         .path = line > 0 ? fmt::format("{}:{}", source.file, line) : source.file,
         .note = ""});
  }
  UrdfSection urdf;
  const auto index = [first](int body) { return body < 0 ? 0 : first + body; };
  for (size_t j = 0; j < tree.joints.size(); ++j) {
    Joint joint = tree.joints[j];
    joint.parent = index(joint.parent);
    joint.child = index(joint.child);
    for (int k = 0; k < 3; ++k) {
      double& offset = joint.X_PF.translation()[k];
      offset = literals_.At(fmt::format("urdf.{}.origin[{}]", joint.name, k), offset);
    }
    urdf.joints[joint.name] = {Severity::kError, source.file, tree.joint_lines[j], 1, "", ""};
    const auto hint = joint.closure ? std::optional(true) : std::nullopt;
    joints->Add(std::move(joint), {}, hint);
  }
  if (tree.root >= 0) urdf.root = first + tree.root;
  for (const auto& [name, frame] : tree.frames) {
    bodies->links[name] = {index(frame.body), frame.X_BF};
  }
  return urdf;
}

void UrdfReader::ReadGuesses(const Block& model, const YamlMap& map, ModelJoints* joints) {
  const auto found = map.FindInUnit("guess", {kPlain, kDeg});
  if (found.node == nullptr) return;
  YamlReader& yaml = values_.yaml();
  for (const YamlEntry& entry : yaml.Entries(*found.node, map.PathOf(found.key))) {
    const std::string path = JoinPath(map.PathOf(found.key), entry.key);
    const int index = joints->Find(entry.key);
    if (index >= 0) {
      joints->guessed.insert(index);
      ReadGuess(model, *entry.value, path, found.unit, &values_, &joints->joints[index]);
      continue;
    }
    std::vector<std::string> names;
    for (const Joint& joint : joints->joints) names.push_back(joint.name);
    yaml.Error(entry, fmt::format("{}: there is no such joint in the URDF file", path),
               DidYouMean(entry.key, names));
  }
}

// As bodies of model files state it.
void UrdfReader::ReadCompensation(const Block& model, const YamlMap& map, ModelBodies* bodies) {
  const std::string key = "gravity_compensation";
  const YamlNode* node = map.Find(key);
  if (node == nullptr) return;
  std::vector<std::string> names;
  for (size_t b = 1; b < bodies->bodies.size(); ++b) names.push_back(bodies->bodies[b].name);
  const YamlMap shares(&values_.yaml(), node, map.PathOf(key), names);
  for (size_t b = 1; b < bodies->bodies.size(); ++b) {
    Body& body = bodies->bodies[b];
    body.gravity_compensation =
        values_.Number(model, shares, body.name, {kPlain}).value_or(body.gravity_compensation);
  }
}

// Those that the closure file names, else, where no model file can name any, the transmissions.
std::vector<std::string> UrdfReader::MotorsOf(const Source& source,
                                              const ModelJoints& joints) const {
  if (!bare_ || !source.motors.empty()) return source.motors;
  std::vector<std::string> motors;
  for (const std::string& name : source.tree.transmission_joints) {
    const int index = joints.Find(name);
    if (index >= 0 && DofsOf(joints.joints[index].kind) == 1) motors.push_back(name);
  }
  return motors;
}

void UrdfReader::AddDrives(const std::vector<std::string>& motors, const YamlNode& at,
                           const Into& into) {
  for (const std::string& motor : motors) {
    if (!HasRoom(at, into.drives->size(), kMaxItems, "drives", &values_.yaml())) return;
    const int joint = into.joints->Find(motor);
    into.drives->push_back({.name = motor,
                            .kind = JointDrive{joint, 0},
                            .range = into.joints->joints[joint].range[0]});
    into.places->Add(motor, "drive", {at.line, at.column});
  }
}

// Names are those of the joints that follow.
void UrdfReader::AddMimics(const UrdfTree& tree, const YamlNode& at, const Into& into) {
  for (const UrdfTree::Mimic& mimic : tree.mimics) {
    const int joint = into.joints->Find(mimic.joint), followed = into.joints->Find(mimic.of);
    const std::string place = "urdf." + mimic.joint + ".mimic.";
    const std::string name = mimic.joint + "_mimic";
    into.couplings->push_back(
        {.name = name,
         .terms = {{joint, 0, {-1.0}},
                   {followed, 0, {literals_.At(place + "multiplier", mimic.multiplier)}}},
         .constant = literals_.At(place + "offset", mimic.offset)});
    into.places->Add(name, "coupling", {at.line, at.column});
  }
}

void UrdfReader::AddDynamics(const UrdfTree& tree, const Into& into) {
  for (const UrdfTree::Dynamics& dynamics : tree.dynamics) {
    const int joint = into.joints->Find(dynamics.joint);
    if (joint < 0) continue;  // refused, with its own finding
    const std::string place = "urdf." + dynamics.joint + ".dynamics.";
    if (dynamics.damping > 0.0) {
      into.elements->push_back(
          {.name = dynamics.joint + "_damping",
           .joint = joint,
           .law = DampingLaw{literals_.At(place + "damping", dynamics.damping)}});
    }
    if (dynamics.friction > 0.0) {
      const double most = literals_.At(place + "friction", dynamics.friction);
      into.elements->push_back({.name = dynamics.joint + "_friction",
                                .joint = joint,
                                .law = FrictionLaw{.coulomb = most, .breakaway = most}});
    }
  }
}

void UrdfReader::AddExtras(const UrdfTree& tree, const Into& into) {
  for (const UrdfTree::Extra& extra : tree.extras) {
    const int joint = into.joints->Find(extra.joint);
    if (joint < 0) continue;  // refused, with its own finding
    const auto add = [&](const char* what, const auto& law) {
      into.elements->push_back({.name = extra.joint + what, .joint = joint, .law = law});
    };
    const std::string place = "urdf." + extra.joint + ".";
    if (extra.stiffness != 0.0) {
      add("_spring", SpringLaw{.polynomial = {literals_.At(place + "spring", extra.stiffness)},
                               .free = extra.free});
    }
    if (extra.rotor_inertia != 0.0) {
      add("_rotor", RotorLaw{.inertia = literals_.At(place + "rotor", extra.rotor_inertia),
                             .ratio = extra.gear_ratio});
    }
  }
}

void UrdfReader::HoldBase(int root, const FloatingBase& wanted, const ModelBodies& bodies,
                          ModelJoints* joints) {
  if (root < 0) return;
  const std::string& base = wanted.held;
  const auto name_of = [&](int body) { return bodies.bodies[static_cast<size_t>(body)].name; };
  const auto refuse = [&](const std::string& text, const std::string& hint) {
    others_.Add({Severity::kError, values_.yaml().file(), 0, 0, text, hint});
  };
  bool floats = true;  // nothing ties the root to the world
  for (const Joint& joint : joints->joints) {
    floats = floats && joint.child != root && !(joint.parent == root && joint.child == 0);
  }
  int held = root;
  Pose X_WB = Pose::Identity();  // of `held`, with the joints at their guesses
  if (bare_ && !base.empty()) {
    std::map<std::string, int> links;
    for (const auto& [link, place] : bodies.links) links[link] = place.body;
    for (size_t k = 1; k < bodies.bodies.size(); ++k) {
      links[bodies.bodies[k].name] = static_cast<int>(k);
    }
    const auto found = links.find(base);
    if (found == links.end() || found->second == 0) {
      std::vector<std::string> names;
      names.reserve(links.size());
      for (const auto& [link, body] : links) names.push_back(link);
      refuse(fmt::format("base {}: there is no link of this name", base), DidYouMean(base, names));
    } else if (!floats) {
      refuse(fmt::format("base {}: the root link '{}' is tied to the world", base, name_of(root)),
             "only a robot that nothing ties to the world needs a base");
    } else {
      held = found->second;
    }
    for (int b = held; b != root;) {
      const auto above = std::ranges::find_if(
          joints->joints, [b](const Joint& joint) { return joint.child == b && !joint.closure; });
      if (above == joints->joints.end()) break;  // a finding of the tree
      X_WB = above->X_PF * JointPose(*above, above->guess) * above->X_CM.inverse() * X_WB;
      b = above->parent;
    }
  }
  if (!floats) return;
  Joint weld;
  if (wanted.free && bare_) {
    weld.name = name_of(root) + ".free";
    weld.kind = JointKind::kFree;
    weld.child = root;
    joints->Add(std::move(weld), {}, std::nullopt);
    return;
  }
  weld.name = name_of(held) + ".weld";
  weld.child = held;
  weld.X_PF = X_WB;
  if (bare_) {
    others_.Add({Severity::kWarning, values_.yaml().file(), 0, 0,
                 fmt::format("the {} '{}' is held: it is fixed to the world",
                             held == root ? "root link" : "link", name_of(held)),
                 held == root ? "--base LINK holds another one" : ""});
  }
  joints->Add(std::move(weld), {}, std::nullopt);
}

// The file beside a URDF tree that names its closed loops, as used with Pinocchio
// (example-parallel-robots): pairs of frames in contact, motors, and joints of other kinds.
//
//   closed_loop: [[A1, B1], …]   links (or joints) whose frames coincide
//   type: [6d, 3d, …]            6d: they are one frame; 3d: their origins meet
//   name_mot: [JOINT, …]         motors
//   joint_name: [JOINT, …]       joints that are not what URDF says
//   joint_type: [SPHERICAL, UJOINT_XY, FIXED, …]
//
// or, as CAD exporters write it (config/loop_closures.yaml), one entry per cut joint:
//
//   closures: [{link_a: A, link_b: B, point: [x, y, z], axis: [x, y, z]}, …]
//   independent: [JOINT, …]      joints that are not solved from the loops
//
// with point and axis in the frame of the root link while all joints are at zero. With an axis the
// cut joint is a hinge, without one a ball.

namespace {

std::string Lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// "closedloop1" of closedloop1_A and closedloop1_B, else both names.
std::string NameOfPair(const std::string& a, const std::string& b, const UrdfTree& tree) {
  std::string name(a.begin(), std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first);
  while (!name.empty() && (name.back() == '_' || name.back() == '.')) name.pop_back();
  const bool taken = std::any_of(tree.joints.begin(), tree.joints.end(),
                                 [&](const Joint& joint) { return joint.name == name; });
  return name.size() < 3 || taken ? a + "_" + b : name;
}

class ClosureFile {
 public:
  ClosureFile(YamlReader* yaml, UrdfTree* tree) : yaml_(*yaml), tree_(*tree) {}

  void Read(const YamlNode& root, std::vector<std::string>* motors) {
    if (root.Find("closures") != nullptr) {
      ReadCuts(root, motors);
      return;
    }
    const YamlMap map(&yaml_, &root, "",
                      {"closed_loop", "type", "name_mot", "joint_name", "joint_type"});
    if (!map.valid()) return;
    ReadKinds(map);
    ReadLoops(map);
    for (const YamlNode* node : ListOf(map, "name_mot")) {
      const auto index = JointNamed(*node, "name_mot");
      if (!index) continue;
      if (DofsOf(tree_.joints[*index].kind) != 1) {
        yaml_.Error(
            *node, fmt::format("name_mot: joint '{}' has {} degrees of freedom, a motor drives one",
                               node->text, DofsOf(tree_.joints[*index].kind)));
      } else {
        motors->push_back(node->text);
      }
    }
  }

 private:
  std::vector<const YamlNode*> ListOf(const YamlMap& map, const std::string& key) {
    const YamlNode* node = map.Find(key);
    if (node == nullptr) return {};
    return yaml_.Items(*node, key).value_or(std::vector<const YamlNode*>{});
  }

  std::optional<int> JointNamed(const YamlNode& node, const std::string& path) {
    const auto name = yaml_.Text(node, path);
    if (!name) return std::nullopt;
    std::vector<std::string> names;
    for (size_t j = 0; j < tree_.joints.size(); ++j) {
      if (tree_.joints[j].name == *name) return static_cast<int>(j);
      names.push_back(tree_.joints[j].name);
    }
    yaml_.Error(node, fmt::format("{}: there is no joint '{}' in the URDF file", path, *name),
                DidYouMean(*name, names));
    return std::nullopt;
  }

  // A link, or the link that a joint carries: their frames are the same in URDF.
  std::optional<int> FrameNamed(const YamlNode& node, const std::string& path) {
    const auto name = yaml_.Text(node, path);
    if (!name) return std::nullopt;
    if (const int link = tree_.FindLink(*name); link > -2) return link;
    std::vector<std::string> names;
    for (const Joint& joint : tree_.joints) {
      if (joint.name == *name) return joint.child;
      names.push_back(joint.name);
    }
    for (const Body& body : tree_.bodies) names.push_back(body.name);
    yaml_.Error(node,
                fmt::format("{}: there is no link or joint '{}' in the URDF file", path, *name),
                DidYouMean(*name, names));
    return std::nullopt;
  }

  void ReadKinds(const YamlMap& map) {
    const auto names = ListOf(map, "joint_name"), types = ListOf(map, "joint_type");
    if (names.size() != types.size()) {
      yaml_.Error(*map.node(), fmt::format("joint_name has {} entries, joint_type {}", names.size(),
                                           types.size()));
      return;
    }
    for (size_t i = 0; i < names.size(); ++i) {
      const auto index = JointNamed(*names[i], fmt::format("joint_name[{}]", i));
      const auto type = yaml_.Text(*types[i], fmt::format("joint_type[{}]", i));
      if (!index || !type) continue;
      Joint& joint = tree_.joints[*index];
      const auto axis = [&](size_t from_end) -> Vec3 {
        return Vec3::Unit(std::string("XYZ").find((*type)[type->size() - from_end]));
      };
      const bool universal = type->size() == 9 && type->starts_with("UJOINT_") &&
                             std::string("XYZ").find((*type)[7]) != std::string::npos &&
                             std::string("XYZ").find((*type)[8]) != std::string::npos &&
                             (*type)[7] != (*type)[8];
      joint.range = {};
      if (*type == "SPHERICAL") {
        joint.kind = JointKind::kSpherical;
      } else if (*type == "FIXED") {
        joint.kind = JointKind::kFixed;
      } else if (universal) {
        joint.kind = JointKind::kUniversal;
        joint.axis = axis(2);
        joint.axis2 = axis(1);
      } else {
        yaml_.Error(*types[i],
                    fmt::format("joint_type[{}] = {} is not known", i, Describe(*types[i])),
                    "SPHERICAL, FIXED, or UJOINT_ with two of X, Y, Z, e.g. UJOINT_XY");
      }
    }
  }

  void ReadLoops(const YamlMap& map) {
    const auto loops = ListOf(map, "closed_loop"), types = ListOf(map, "type");
    if (!types.empty() && types.size() != loops.size()) {
      yaml_.Error(*map.node(),
                  fmt::format("closed_loop has {} entries, type {}", loops.size(), types.size()));
      return;
    }
    for (size_t i = 0; i < loops.size(); ++i) {
      const std::string path = fmt::format("closed_loop[{}]", i);
      const auto pair = yaml_.Items(*loops[i], path, 2);
      if (!pair) continue;
      const auto a = FrameNamed(*(*pair)[0], path), b = FrameNamed(*(*pair)[1], path);
      std::string type = "6d";
      if (!types.empty()) {
        type = Lower(yaml_.Text(*types[i], fmt::format("type[{}]", i)).value_or("6d"));
      }
      if (type != "6d" && type != "3d") {
        yaml_.Error(*types[i], fmt::format("type[{}] = '{}' is neither 6d nor 3d", i, type));
      }
      if (!a || !b) continue;
      if (*a == *b) {
        yaml_.Error(*loops[i], fmt::format("{} connects a link with itself", path));
        continue;
      }
      Joint joint;
      joint.name = NameOfPair((*pair)[0]->text, (*pair)[1]->text, tree_);
      joint.kind = type == "3d" ? JointKind::kSpherical : JointKind::kFixed;
      joint.parent = *a;
      joint.child = *b;
      joint.closure = true;
      tree_.joints.push_back(joint);
      tree_.joint_lines.push_back(0);
    }
  }

  void ReadCuts(const YamlNode& root, std::vector<std::string>* motors) {
    const auto closures = yaml_.Items(*root.Find("closures"), "closures");
    if (!closures) return;
    const std::vector<Pose> X_RL = PosesAtZero();
    for (size_t i = 0; i < closures->size(); ++i) {
      ReadCut(*(*closures)[i], fmt::format("closures[{}]", i), X_RL);
    }
    const YamlNode* independent = root.Find("independent");
    if (independent == nullptr || independent->is_null()) return;
    const auto names = yaml_.Items(*independent, "independent");
    for (const YamlNode* node : names.value_or(std::vector<const YamlNode*>{})) {
      const auto index = JointNamed(*node, "independent");
      if (index && DofsOf(tree_.joints[*index].kind) == 1) motors->push_back(node->text);
    }
  }

  void ReadCut(const YamlNode& node, const std::string& path, const std::vector<Pose>& X_RL) {
    std::optional<int> links[2];
    for (int side = 0; side < 2; ++side) {
      const std::string key = side == 0 ? "link_a" : "link_b";
      const YamlNode* link = node.Find(key);
      if (link == nullptr) {
        yaml_.Error(node, fmt::format("{}.{} is missing", path, key),
                    "link_a, link_b, point, and axis for a hinge");
      } else {
        links[side] = FrameNamed(*link, JoinPath(path, key));
      }
    }
    const auto point = CutVector(node, "point", path, true);
    const auto axis = CutVector(node, "axis", path, false);
    if (!links[0] || !links[1] || !point || yaml_.has_errors()) return;
    if (*links[0] == *links[1]) {
      yaml_.Error(node, fmt::format("{} connects a link with itself", path));
      return;
    }
    Joint joint;
    const std::string a = node.Find("link_a")->text, b = node.Find("link_b")->text;
    joint.name = NameOfPair(a, b, tree_);
    joint.kind = axis ? JointKind::kRevolute : JointKind::kSpherical;
    if (axis) joint.axis = axis->normalized();
    Pose X_RF = Pose::Identity();
    X_RF.translation() = *point;
    const auto pose = [&](int link) { return link < 0 ? Pose::Identity() : X_RL[link]; };
    joint.parent = *links[0];
    joint.X_PF = pose(*links[0]).inverse() * X_RF;
    joint.child = *links[1];
    joint.X_CM = pose(*links[1]).inverse() * X_RF;
    joint.closure = true;
    tree_.joints.push_back(joint);
    tree_.joint_lines.push_back(0);
  }

  std::optional<Vec3> CutVector(const YamlNode& node, const std::string& key,
                                const std::string& path, bool required) {
    const YamlNode* found = node.Find(key);
    if (found == nullptr || found->is_null()) {
      if (required) yaml_.Error(node, fmt::format("{}.{} is missing", path, key));
      return std::nullopt;
    }
    const auto items = yaml_.Items(*found, JoinPath(path, key), 3);
    if (!items) return std::nullopt;
    Vec3 v = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      const auto value = yaml_.Number(*(*items)[k], fmt::format("{}.{}[{}]", path, key, k));
      if (!value) return std::nullopt;
      v[k] = *value;
    }
    if (required || v.norm() > 1e-9) return v;
    yaml_.Error(*found, fmt::format("{}.{} has no direction", path, key));
    return std::nullopt;
  }

  // Links in the frame of the root link (or the world) while all joints are at zero; parents come
  // first.
  [[nodiscard]] std::vector<Pose> PosesAtZero() const {
    std::vector<Pose> X_RL(tree_.bodies.size(), Pose::Identity());
    for (const Joint& joint : tree_.joints) {
      if (joint.closure || joint.child < 0) continue;
      const Pose X_RP = joint.parent < 0 ? Pose::Identity() : X_RL[joint.parent];
      X_RL[joint.child] = X_RP * joint.X_PF * joint.X_CM.inverse();
    }
    return X_RL;
  }

  YamlReader& yaml_;
  UrdfTree& tree_;
};

}  // namespace

void DropClosures(UrdfTree* tree) {
  while (!tree->joints.empty() && tree->joints.back().closure) {
    tree->joints.pop_back();
    tree->joint_lines.pop_back();
  }
}

bool ReadClosureFile(const YamlNode& node, YamlReader* yaml, Diagnostics* others, UrdfTree* tree,
                     std::vector<std::string>* motors) {
  const auto file = yaml->Text(node, "urdf.closures");
  if (!file) return false;
  const std::filesystem::path path = std::filesystem::path(yaml->file()).parent_path() / *file;
  YamlReader reader(path.string());
  const auto text = reader.ReadFile();
  if (!text) {
    yaml->Error(node, fmt::format("urdf.closures = {} cannot be read", Describe(node)),
                "the path is relative to this file");
    return false;
  }
  const YamlNodePtr root = reader.Parse(*text);
  if (root != nullptr) ClosureFile(&reader, tree).Read(*root, motors);
  others->Append(reader.diagnostics());
  return !reader.has_errors();
}

}  // namespace mbv::internal
