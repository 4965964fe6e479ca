// What a mechanism is driven by and watched at: drives, prescribed joints, outputs; and springs.
#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "model_file/model_reader.h"

namespace mbv {

void ModelReader::ReadDrives(const Block& block) {
  const YamlNode* drives = block.Section("drives");
  if (drives == nullptr) return;
  for (const YamlEntry& entry : yaml_.Entries(*drives, block.PathOf("drives"))) {
    ReadDrive(block, entry);
  }
}

void ModelReader::ReadDrive(const Block& block, const YamlEntry& entry) {
  const std::string path = JoinPath(block.PathOf("drives"), entry.key);
  if (!CheckNewName(entry, block.PathOf("drives"))) return;
  if (!Room(*entry.value, mechanism_.drives.size(), kMaxItems, "drives")) return;
  const YamlNode* kind_node = entry.value->is_map() ? entry.value->Find("kind") : nullptr;
  const bool joint_drive = kind_node != nullptr && kind_node->text == "joint";
  const YamlMap map(
      &yaml_, entry.value.get(), path,
      joint_drive ? std::vector<std::string>{"kind", "joint", "coordinate", "range", "range_deg",
                                             "range_mm", "stiffness", "compliance"}
                  : std::vector<std::string>{"kind", "from", "to", "range", "range_mm", "radius",
                                             "radius_mm", "stiffness", "compliance"});
  if (!map.valid() || map.Required("kind") == nullptr) return;
  if (!yaml_.Choice(*kind_node, map.PathOf("kind"), {"joint", "distance"})) return;
  Drive drive;
  drive.name = block.prefix + entry.key;
  if (joint_drive) {
    const auto on_joint = ReadJointDrive(block, map);
    if (!on_joint) return;
    drive.kind = *on_joint;
  } else {
    DistanceDrive distance;
    if (!ReadEnds(block, map, &distance)) return;
    drive.kind = distance;
    if (map.Has("radius") || map.Has("radius_mm")) {
      drive.radius = Radius(block, map).value_or(0.0);
    }
  }
  if (const auto range = map.FindInUnit("range", {kPlain, kDeg, kMm}); range.node != nullptr) {
    const std::string unit = PositionUnit(mechanism_, drive);
    if (!range.unit.Suits(unit)) {
      yaml_.Error(*range.node, fmt::format("{}: the drive's position is {}", map.PathOf(range.key),
                                           unit == "m" ? "a length" : "an angle"));
    }
    drive.range =
        Range(block, *range.node, map.PathOf(range.key), range.unit).value_or(CoordinateRange{});
  }
  drive.stiffness = ReadDriveStiffness(block, map);
  mechanism_.drives.push_back(drive);
  signal_places_[drive.name].push_back({"drive", &entry});
}

// Of the servo [N/m or N m/rad]; infinite (locked) when neither key is given.
double ModelReader::ReadDriveStiffness(const Block& block, const YamlMap& map) {
  const double locked = std::numeric_limits<double>::infinity();
  if (map.Has("stiffness") && map.Has("compliance")) {
    yaml_.Error(*map.node(), fmt::format("{} has both stiffness and compliance", map.path()),
                "compliance is 1/stiffness; give one of them");
    return locked;
  }
  if (map.Has("stiffness")) return Positive(block, map, "stiffness", {kPlain}).value_or(locked);
  const auto compliance = Number(block, map, "compliance", {kPlain});
  if (!compliance || *compliance == 0.0) return locked;
  if (*compliance > 0.0) return 1.0 / *compliance;
  yaml_.Error(*map.Find("compliance"), fmt::format("{} = {} violates compliance >= 0",
                                                   map.PathOf("compliance"), *compliance));
  return locked;
}

std::optional<JointDrive> ModelReader::ReadJointDrive(const Block& block, const YamlMap& map) {
  const YamlNode* joint_node = map.Required("joint");
  if (joint_node == nullptr) return std::nullopt;
  const auto index = JointRef(block, *joint_node, map.PathOf("joint"));
  JointDrive drive;
  const YamlNode* coordinate = map.Find("coordinate");
  if (coordinate != nullptr) {
    const auto value = yaml_.Integer(*coordinate, map.PathOf("coordinate"));
    if (!value) return std::nullopt;
    drive.coordinate = *value;
  }
  if (!index) return std::nullopt;
  drive.joint = *index;
  const Joint& joint = mechanism_.joints[*index];
  const int n = FreedomsOf(joint.kind);
  if (drive.coordinate < 0 || drive.coordinate >= n) {
    yaml_.Error(coordinate == nullptr ? *joint_node : *coordinate,
                fmt::format("{}: coordinate {} of joint '{}', which has {} coordinates", map.path(),
                            drive.coordinate, joint.name, n),
                "coordinates are counted from 0");
    return std::nullopt;
  }
  if (IsOfBall(joint.kind, drive.coordinate)) {
    yaml_.Error(
        *joint_node,
        fmt::format("{}: a rotation of joint '{}' has no axis to drive", map.path(), joint.name),
        "write the joint as universal and revolute joints with a body between");
    return std::nullopt;
  }
  return drive;
}

// The two points of a distance drive or a spring.
template <typename Line>
bool ModelReader::ReadEnds(const Block& block, const YamlMap& map, Line* line) {
  const YamlNode* from_node = map.Required("from");
  const YamlNode* to_node = map.Required("to");
  const auto from = from_node ? Frame(block, *from_node, map.PathOf("from")) : std::nullopt;
  const auto to = to_node ? Frame(block, *to_node, map.PathOf("to")) : std::nullopt;
  if (!from || !to) return false;
  if (from->body == to->body) {
    yaml_.Error(*to_node, fmt::format("{}: both ends are on body '{}'", map.path(),
                                      mechanism_.bodies[to->body].name));
    return false;
  }
  line->body_from = from->body;
  line->p_from = from->X_BF.translation();
  line->body_to = to->body;
  line->p_to = to->X_BF.translation();
  return true;
}

void ModelReader::ReadPrescribed(const Block& block) {
  const YamlNode* prescribed = block.Section("prescribed");
  if (prescribed == nullptr) return;
  const std::string section = block.PathOf("prescribed");
  for (const YamlEntry& entry : yaml_.Entries(*prescribed, section)) {
    if (!CheckNewName(entry, section)) continue;
    const YamlMap map(&yaml_, entry.value.get(), JoinPath(section, entry.key), {"joint"});
    const YamlNode* node = map.Required("joint");
    if (node == nullptr) continue;
    const auto joint = JointRef(block, *node, map.PathOf("joint"));
    if (!joint) continue;
    if (FreedomsOf(mechanism_.joints[*joint].kind) != 1) {
      yaml_.Error(
          *node,
          fmt::format("{}: joint '{}' has {} coordinates, one is needed", map.path(),
                      mechanism_.joints[*joint].name, FreedomsOf(mechanism_.joints[*joint].kind)),
          "split the joint by massless bodies");
      continue;
    }
    mechanism_.prescribed.push_back({block.prefix + entry.key, *joint});
    signal_places_[block.prefix + entry.key].push_back({"prescribed joint", &entry});
  }
}

void ModelReader::ReadOutputs(const Block& block) {
  const YamlNode* outputs = block.Section("outputs");
  if (outputs == nullptr) return;
  const std::string section = block.PathOf("outputs");
  for (const YamlEntry& entry : yaml_.Entries(*outputs, section)) {
    if (!CheckNewName(entry, section)) continue;
    const std::string path = JoinPath(section, entry.key);
    const YamlNode* frame_node = entry.value.get();
    const YamlNode* in_node = nullptr;
    if (frame_node->is_map()) {
      const YamlMap map(&yaml_, frame_node, path, {"frame", "in"});
      in_node = map.Find("in");
      frame_node = map.Required("frame");
      if (frame_node == nullptr) continue;
    }
    const auto frame = Frame(block, *frame_node, path);
    const auto in = in_node ? Frame(block, *in_node, path + ".in") : FrameRef{};
    if (!frame || !in) continue;
    mechanism_.outputs.push_back({.name = block.prefix + entry.key,
                                  .body = frame->body,
                                  .X_BO = frame->X_BF,
                                  .reference_body = in->body,
                                  .X_RbR = in->X_BF});
    signal_places_[block.prefix + entry.key].push_back({"output", &entry});
  }
}

void ModelReader::ReadSprings(const Block& block) {
  const YamlNode* springs = block.Section("springs");
  if (springs == nullptr) return;
  const std::string section = block.PathOf("springs");
  std::set<std::string> names;
  for (const YamlEntry& entry : yaml_.Entries(*springs, section)) {
    if (!CheckNewName(entry, section)) continue;
    if (!Room(*entry.value, mechanism_.springs.size(), kMaxItems, "springs")) return;
    const YamlMap map(&yaml_, entry.value.get(), JoinPath(section, entry.key),
                      {"from", "to", "stiffness", "damping", "free_length", "free_length_mm"});
    SpringDamper spring;
    spring.name = block.prefix + entry.key;
    const bool good = ReadEnds(block, map, &spring);
    spring.stiffness = Number(block, map, "stiffness", {kPlain}).value_or(0.0);
    spring.damping = Number(block, map, "damping", {kPlain}).value_or(0.0);
    spring.free_length_m = Number(block, map, "free_length", {kPlain, kMm}).value_or(0.0);
    for (const auto& [key, value] :
         {std::pair{"stiffness", spring.stiffness}, std::pair{"damping", spring.damping},
          std::pair{"free_length", spring.free_length_m}}) {
      if (value >= 0.0) continue;
      yaml_.Error(entry, fmt::format("{} = {} violates {} >= 0", map.PathOf(key), value, key));
    }
    if (good) mechanism_.springs.push_back(spring);
  }
}

// `drive_order` lists every drive once.
void ModelReader::OrderDrives(const YamlNode& root) {
  const YamlNode* order = root.is_map() ? root.Find("drive_order") : nullptr;
  if (order == nullptr || order->is_null()) return;
  const auto items = yaml_.Items(*order, "drive_order");
  if (!items) return;
  std::vector<Drive> ordered;
  std::vector<std::string> left;
  for (const Drive& drive : mechanism_.drives) left.push_back(drive.name);
  for (const YamlNode* item : *items) {
    const auto at = yaml_.Choice(*item, "drive_order", left);
    if (!at) continue;
    ordered.push_back(mechanism_.drives[mechanism_.FindDrive(left[*at])]);
    left.erase(left.begin() + *at);
  }
  if (!left.empty()) {
    yaml_.Error(*order, fmt::format("drive_order leaves out '{}'", left.front()));
    return;
  }
  mechanism_.drives = std::move(ordered);
}

// Scenarios command drives, prescribed joints and outputs by one name.
void ModelReader::CheckCoordinateNames() {
  for (const auto& [name, uses] : signal_places_) {
    for (size_t i = 1; i < uses.size(); ++i) {
      yaml_.Error(*uses[i].entry,
                  fmt::format("the {} '{}' has the name of the {} in line {}", uses[i].what, name,
                              uses[0].what, uses[0].entry->line));
    }
  }
  std::map<int, std::string> driven;
  const auto check = [&](int joint, int coordinate, const std::string& name) {
    const auto [it, fresh] = driven.emplace(joint * 6 + coordinate, name);
    if (fresh) return;
    yaml_.Error(*signal_places_[name].front().entry,
                fmt::format("'{}' moves the same coordinate of joint '{}' as '{}'", name,
                            mechanism_.joints[joint].name, it->second));
  };
  for (const Drive& drive : mechanism_.drives) {
    const auto* on_joint = std::get_if<JointDrive>(&drive.kind);
    if (on_joint != nullptr) check(on_joint->joint, on_joint->coordinate, drive.name);
  }
  for (const Prescribed& prescribed : mechanism_.prescribed) {
    check(prescribed.joint, 0, prescribed.name);
  }
}

}  // namespace mbv
