#include "model_file/model_urdf.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>

#include "model_file/model_urdf_closures.h"
#include "model_file/urdf_frame_links.h"

namespace mbv::internal {

UrdfSection UrdfReader::Read(const Block& model, const YamlNode& node, const Into& into) {
  YamlReader& yaml = values_.yaml();
  const bool short_form = node.is_scalar();
  const YamlMap map(&yaml, short_form ? nullptr : &node, "urdf",
                    {"file", "closures", "constraints", "guess", "guess_deg"});
  const YamlNode* name = short_form ? &node : map.Required("file");
  into.joints->good = false;  // until the tree is read
  const auto source = name == nullptr ? std::nullopt : ReadSource(model, *name, map);
  if (!source) return {};
  if (!HasRoom(node, source->tree.bodies.size(), kMaxBodies + 1, "bodies", &yaml)) return {};
  into.joints->good = true;
  UrdfSection urdf = Add(*source, into.bodies, into.joints);
  urdf.left_out = source->tree.left_out;
  urdf.gravity_W = source->tree.gravity_W;
  ReadGuesses(model, map, into.joints);
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
  FoldFrameLinks(keep, source.motors, source.file, &source.tree, &others_);
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

// Those that the closure file names, else, where no model file can name any, the transmissions.
std::vector<std::string> UrdfReader::MotorsOf(const Source& source,
                                              const ModelJoints& joints) const {
  if (!bare_ || !source.motors.empty()) return source.motors;
  std::vector<std::string> motors;
  for (const std::string& name : source.tree.transmission_joints) {
    const int index = joints.Find(name);
    if (index >= 0 && FreedomsOf(joints.joints[index].kind) == 1) motors.push_back(name);
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

void UrdfReader::WeldRoot(int root, const ModelBodies& bodies, ModelJoints* joints) {
  if (root < 0) return;
  for (const Joint& joint : joints->joints) {
    if (joint.child == root || (joint.parent == root && joint.child == 0)) return;
  }
  const std::string& name = bodies.bodies[root].name;
  Joint weld;
  weld.name = name + ".weld";
  weld.child = root;
  if (bare_) {
    others_.Add({Severity::kWarning, values_.yaml().file(), 0, 0,
                 fmt::format("the root link '{}' is held: it is fixed to the world", name), ""});
  }
  joints->Add(std::move(weld), {}, std::nullopt);
}

}  // namespace mbv::internal
