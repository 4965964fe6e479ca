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
#include "model_file/model_urdf_closures.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>

namespace mbv::internal {
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
      if (FreedomsOf(tree_.joints[*index].kind) != 1) {
        yaml_.Error(*node, fmt::format("name_mot: joint '{}' has {} freedoms, a motor drives one",
                                       node->text, FreedomsOf(tree_.joints[*index].kind)));
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
      if (index && FreedomsOf(tree_.joints[*index].kind) == 1) motors->push_back(node->text);
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
