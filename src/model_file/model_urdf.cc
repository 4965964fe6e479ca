// The `urdf:` key of a model file: FILE, or {file, closures, constraints, guess: {JOINT: …}}.
#include <fmt/format.h>

#include <filesystem>

#include "model_file/model_reader.h"
#include "model_file/urdf.h"
#include "model_file/urdf_frame_links.h"

namespace mbv {

void ModelReader::ImportUrdf(const YamlNode& node) {
  const bool short_form = node.is_scalar();
  const YamlMap map(&yaml_, short_form ? nullptr : &node, "urdf",
                    {"file", "closures", "constraints", "guess", "guess_deg"});
  const YamlNode* name = short_form ? &node : map.Required("file");
  const auto file = name == nullptr ? std::nullopt : yaml_.Text(*name, "urdf");
  joints_good_ = false;  // until the tree is read
  if (!file) return;
  const std::filesystem::path path = std::filesystem::path(yaml_.file()).parent_path() / *file;
  YamlReader reader(path.string());
  const auto text = reader.ReadFile();
  if (!text) {
    yaml_.Error(*name, fmt::format("urdf = {} cannot be read", Describe(*name)),
                "the path is relative to this file");
    return;
  }
  Diagnostics findings;
  UrdfTree tree = ReadUrdf(*text, path.string(), &findings);
  other_findings_.Append(findings);
  if (findings.has_errors()) return;
  if (const YamlNode* constraints = map.Find("constraints")) {
    if (!yaml_.Flag(*constraints, map.PathOf("constraints")).value_or(true)) DropClosures(&tree);
  }
  std::vector<std::string> motors;
  const YamlNode* closures = map.Find("closures");
  if (closures != nullptr && !ReadClosureFile(*closures, &tree, &motors)) return;
  std::set<std::string> keep;  // bodies that the model file writes on
  if (const YamlNode* attach = blocks_.front().Section("attach")) {
    for (const YamlEntry& entry : attach->entries) keep.insert(entry.key);
  }
  internal::FoldFrameLinks(keep, motors, path.string(), &tree, &other_findings_);
  if (!Room(node, tree.bodies.size(), kMaxBodies + 1, "bodies")) return;
  joints_good_ = true;
  AddUrdf(tree, path.string());
  ReadUrdfGuesses(map, tree.joints);
  if (bare_urdf_ && motors.empty()) {
    for (const std::string& name : tree.transmission_joints) {
      const int index = mechanism_.FindJoint(name);
      if (index >= 0 && FreedomsOf(mechanism_.joints[index].kind) == 1) motors.push_back(name);
    }
  }
  // The model file's own drives are the better ones.
  if (blocks_.front().Section("drives") == nullptr) AddUrdfDrives(motors, &node);
}

void ModelReader::TakeUrdfLiterals(Body* body) {
  const std::string place = "urdf." + body->name;
  body->mass = LiteralAt(place + ".mass", body->mass);
  for (int row = 0; row < 3; ++row) {
    body->p_BoBcm_B[row] = LiteralAt(fmt::format("{}.com[{}]", place, row), body->p_BoBcm_B[row]);
    for (int col = row; col < 3; ++col) {
      const std::string key = {"xyz"[row], "xyz"[col]};
      const double value = LiteralAt(place + ".inertia." + key, body->I_Bcm_B(row, col));
      body->I_Bcm_B(row, col) = body->I_Bcm_B(col, row) = value;
    }
  }
}

void ModelReader::AddUrdf(const UrdfTree& tree, const std::string& file) {
  const int first = static_cast<int>(mechanism_.bodies.size());
  for (size_t b = 0; b < tree.bodies.size(); ++b) {
    mechanism_.bodies.push_back(tree.bodies[b]);
    TakeUrdfLiterals(&mechanism_.bodies.back());
    body_places_.push_back(nullptr);
    body_paths_.push_back(tree.body_lines[b] > 0 ? fmt::format("{}:{}", file, tree.body_lines[b])
                                                 : file);
  }
  const auto index = [first](int body) { return body < 0 ? 0 : first + body; };
  hints_.resize(mechanism_.joints.size());
  for (size_t j = 0; j < tree.joints.size(); ++j) {
    Joint joint = tree.joints[j];
    joint.parent = index(joint.parent);
    joint.child = index(joint.child);
    for (int k = 0; k < 3; ++k) {
      double& offset = joint.X_PF.translation()[k];
      offset = LiteralAt(fmt::format("urdf.{}.origin[{}]", joint.name, k), offset);
    }
    hints_.push_back(joint.closure ? std::optional(true) : std::nullopt);
    mechanism_.joints.push_back(joint);
    joint_places_.push_back(nullptr);
    urdf_places_[joint.name] = {Severity::kError, file, tree.joint_lines[j], 1, "", ""};
  }
  if (tree.root >= 0) urdf_root_ = first + tree.root;
  for (const auto& [name, frame] : tree.frames) {
    urdf_frames_[name] = {index(frame.body), frame.X_BF};
  }
}

void ModelReader::ReadUrdfGuesses(const YamlMap& map, const std::vector<Joint>& joints) {
  const auto found = map.FindInUnit("guess", {kPlain, kDeg});
  if (found.node == nullptr) return;
  const Block& model = blocks_.front();
  for (const YamlEntry& entry : yaml_.Entries(*found.node, map.PathOf(found.key))) {
    const std::string path = JoinPath(map.PathOf(found.key), entry.key);
    const int index = mechanism_.FindJoint(entry.key);
    if (index < 0) {
      std::vector<std::string> names;
      for (const Joint& joint : joints) names.push_back(joint.name);
      const std::string near = ClosestWord(entry.key, names);
      yaml_.Error(entry, fmt::format("{}: there is no such joint in the URDF file", path),
                  near.empty() ? "" : fmt::format("did you mean '{}'?", near));
      continue;
    }
    ReadGuess(model, *entry.value, path, found.unit, &mechanism_.joints[index]);
  }
}

void ModelReader::AddUrdfDrives(const std::vector<std::string>& motors, const YamlNode* at) {
  for (const std::string& motor : motors) {
    YamlEntry& place = urdf_drives_.emplace_back();
    place.key = motor;
    place.line = at->line;
    place.column = at->column;
    if (!Room(*at, mechanism_.drives.size(), kMaxItems, "drives")) return;
    Drive drive{.name = motor, .kind = JointDrive{mechanism_.FindJoint(motor), 0}, .range = {}};
    drive.range = mechanism_.joints[mechanism_.FindJoint(motor)].range[0];
    mechanism_.drives.push_back(drive);
    signal_places_[motor].push_back({"drive", &place});
  }
}

// The root link is fixed to the world unless a joint of the model file carries it.
void ModelReader::WeldUrdfRoot() {
  if (urdf_root_ < 0) return;
  for (const Joint& joint : mechanism_.joints) {
    if (joint.child == urdf_root_ || (joint.parent == urdf_root_ && joint.child == 0)) return;
  }
  Joint weld;
  weld.name = mechanism_.bodies[urdf_root_].name + ".weld";
  weld.child = urdf_root_;
  if (bare_urdf_) {
    other_findings_.Add({Severity::kWarning, yaml_.file(), 0, 0,
                         fmt::format("the root link '{}' is held: it is fixed to the world",
                                     mechanism_.bodies[urdf_root_].name),
                         ""});
  }
  mechanism_.joints.push_back(weld);
  joint_places_.push_back(nullptr);
  hints_.resize(mechanism_.joints.size());
}

}  // namespace mbv
