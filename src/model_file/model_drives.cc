#include "model_file/model_drives.h"

#include <fmt/format.h>

#include <limits>

namespace mbv::internal {

void DriveReader::Read(const Block& block) {
  for (const YamlEntry& entry : block.Entries("drives", &values_.yaml())) ReadDrive(block, entry);
}

void DriveReader::ReadDrive(const Block& block, const YamlEntry& entry) {
  YamlReader& yaml = values_.yaml();
  const std::string path = JoinPath(block.PathOf("drives"), entry.key);
  if (!IsNewName(entry, block.PathOf("drives"), &yaml)) return;
  if (!HasRoom(*entry.value, drives_.size(), kMaxItems, "drives", &yaml)) return;
  const YamlNode* kind_node = entry.value->is_map() ? entry.value->Find("kind") : nullptr;
  const bool joint_drive = kind_node != nullptr && kind_node->text == "joint";
  const YamlMap map(
      &yaml, entry.value.get(), path,
      joint_drive ? std::vector<std::string>{"kind", "joint", "coordinate", "range", "range_deg",
                                             "range_mm", "stiffness", "compliance"}
                  : std::vector<std::string>{"kind", "from", "to", "range", "range_mm", "radius",
                                             "radius_mm", "stiffness", "compliance"});
  if (!map.valid() || map.Required("kind") == nullptr) return;
  if (!yaml.Choice(*kind_node, map.PathOf("kind"), {"joint", "distance"})) return;
  Drive drive;
  drive.name = block.prefix + entry.key;
  if (joint_drive) {
    const auto on_joint = ReadJointCoordinate(joints_, block, map, {}, &values_.yaml());
    if (!on_joint) return;
    drive.kind = *on_joint;
  } else if (!ReadDistanceDrive(block, map, &drive)) {
    return;
  }
  ReadRange(block, map, &drive);
  drive.stiffness = ReadStiffness(block, map);
  places_.Add(drive.name, "drive", PlaceOf(entry));
  drives_.push_back(std::move(drive));
}

bool DriveReader::ReadDistanceDrive(const Block& block, const YamlMap& map, Drive* drive) {
  DistanceDrive distance;
  if (!names_.Ends(block, map, &distance)) return false;
  drive->kind = distance;
  if (map.Has("radius") || map.Has("radius_mm")) {
    drive->radius = values_.Radius(block, map).value_or(0.0);
  }
  return true;
}

void DriveReader::ReadRange(const Block& block, const YamlMap& map, Drive* drive) {
  const auto range = map.FindInUnit("range", {kPlain, kDeg, kMm});
  if (range.node == nullptr) return;
  const auto* on_joint = std::get_if<JointDrive>(&drive->kind);
  const bool is_length =
      on_joint == nullptr || IsLength(joints_.joints[on_joint->joint].kind, on_joint->coordinate);
  if (!range.unit.Suits(is_length ? "m" : "rad")) {
    values_.yaml().Error(*range.node,
                         fmt::format("{}: the drive's position is {}", map.PathOf(range.key),
                                     is_length ? "a length" : "an angle"));
  }
  drive->range = values_.Range(block, *range.node, map.PathOf(range.key), range.unit)
                     .value_or(CoordinateRange{});
}

// Of the servo [N/m or N m/rad]; infinite (locked) when neither key is given.
double DriveReader::ReadStiffness(const Block& block, const YamlMap& map) {
  const double locked = std::numeric_limits<double>::infinity();
  if (map.Has("stiffness") && map.Has("compliance")) {
    values_.yaml().Error(*map.node(),
                         fmt::format("{} has both stiffness and compliance", map.path()),
                         "compliance is 1/stiffness; give one of them");
    return locked;
  }
  if (map.Has("stiffness")) {
    return values_.Positive(block, map, "stiffness", {kPlain}).value_or(locked);
  }
  const auto compliance = values_.Number(block, map, "compliance", {kPlain});
  if (!compliance || *compliance == 0.0) return locked;
  if (*compliance > 0.0) return 1.0 / *compliance;
  values_.yaml().Error(*map.Find("compliance"), fmt::format("{} = {} violates compliance >= 0",
                                                            map.PathOf("compliance"), *compliance));
  return locked;
}

std::optional<JointDrive> ReadJointCoordinate(const ModelJoints& joints, const Block& block,
                                              const YamlMap& map, const CoordinateKeys& keys,
                                              YamlReader* yaml) {
  const YamlNode* joint_node = map.Required(keys.joint);
  if (joint_node == nullptr) return std::nullopt;
  const auto index = FindJointNamed(joints, block, *joint_node, map.PathOf(keys.joint), yaml);
  JointDrive drive;
  const YamlNode* coordinate = map.Find(keys.coordinate);
  if (coordinate != nullptr) {
    const auto value = yaml->Integer(*coordinate, map.PathOf(keys.coordinate));
    if (!value) return std::nullopt;
    drive.coordinate = *value;
  }
  if (!index) return std::nullopt;
  drive.joint = *index;
  const Joint& joint = joints.joints[*index];
  const int n = FreedomsOf(joint.kind);
  if (drive.coordinate < 0 || drive.coordinate >= n) {
    yaml->Error(coordinate == nullptr ? *joint_node : *coordinate,
                fmt::format("{}: coordinate {} of joint '{}', which has {} coordinates", map.path(),
                            drive.coordinate, joint.name, n),
                "coordinates are counted from 0");
    return std::nullopt;
  }
  if (IsOfBall(joint.kind, drive.coordinate)) {
    yaml->Error(
        *joint_node,
        fmt::format("{}: a rotation of joint '{}' has no axis to drive", map.path(), joint.name),
        "write the joint as universal and revolute joints with a body between");
    return std::nullopt;
  }
  return drive;
}

std::optional<std::vector<double>> ReadCoefficients(ModelValues* values, const Block& block,
                                                    const YamlMap& map, const std::string& key) {
  YamlReader& yaml = values->yaml();
  const YamlNode& node = *map.Find(key);
  std::vector<const YamlNode*> items{&node};
  if (key == "polynomial") {
    const auto listed = yaml.Items(node, map.PathOf(key));
    if (!listed) return std::nullopt;
    items = *listed;
  }
  std::vector<double> coefficients;
  for (const YamlNode* item : items) {
    const std::string path = items.size() > 1
                                 ? fmt::format("{}[{}]", map.PathOf(key), coefficients.size())
                                 : map.PathOf(key);
    const auto value = values->Number(block, *item, path);
    if (!value) return std::nullopt;
    coefficients.push_back(*value);
  }
  if (coefficients.empty() || coefficients.size() > kMostPowers) {
    yaml.Error(node,
               fmt::format("{} has {} coefficients, {} are allowed", map.PathOf(key),
                           coefficients.size(), coefficients.empty() ? "1 to 4" : "at most 4"));
    return std::nullopt;
  }
  return coefficients;
}

std::optional<double> ReadInCoordinateUnit(ModelValues* values, const Block& block,
                                           const YamlMap& map, const std::string& key, bool length,
                                           const std::string& of) {
  const auto found = map.FindInUnit(key, {kPlain, kDeg, kMm});
  if (found.node == nullptr) return 0.0;
  if (!found.unit.Suits(length ? "m" : "rad")) {
    values->yaml().Error(*found.node,
                         fmt::format("{}: the coordinate of '{}' is {}", map.PathOf(found.key), of,
                                     length ? "a length" : "an angle"));
    return std::nullopt;
  }
  return values->Number(block, *found.node, map.PathOf(found.key), found.unit);
}

void OrderDrives(const YamlNode& root, YamlReader* yaml, std::vector<Drive>* drives) {
  const YamlNode* order = root.is_map() ? root.Find("drive_order") : nullptr;
  if (order == nullptr || order->is_null()) return;
  const auto items = yaml->Items(*order, "drive_order");
  if (!items) return;
  std::vector<Drive> ordered;
  std::vector<std::string> left;
  for (const Drive& drive : *drives) left.push_back(drive.name);
  for (const YamlNode* item : *items) {
    const auto at = yaml->Choice(*item, "drive_order", left);
    if (!at) continue;
    ordered.push_back((*drives)[static_cast<size_t>(IndexOf(*drives, left[*at]))]);
    left.erase(left.begin() + *at);
  }
  if (!left.empty()) {
    yaml->Error(*order, fmt::format("drive_order leaves out '{}'", left.front()));
    return;
  }
  *drives = std::move(ordered);
}

void ReadPrescribed(const Block& block, const ModelJoints& joints, YamlReader* yaml,
                    SignalPlaces* places, std::vector<Prescribed>* prescribed) {
  const std::string section = block.PathOf("prescribed");
  for (const YamlEntry& entry : block.Entries("prescribed", yaml)) {
    if (!IsNewName(entry, section, yaml)) continue;
    const YamlMap map(yaml, entry.value.get(), JoinPath(section, entry.key), {"joint"});
    const YamlNode* node = map.Required("joint");
    if (node == nullptr) continue;
    const auto index = FindJointNamed(joints, block, *node, map.PathOf("joint"), yaml);
    if (!index) continue;
    const Joint& joint = joints.joints[*index];
    if (FreedomsOf(joint.kind) != 1) {
      yaml->Error(*node,
                  fmt::format("{}: joint '{}' has {} coordinates, one is needed", map.path(),
                              joint.name, FreedomsOf(joint.kind)),
                  "split the joint by massless bodies");
      continue;
    }
    prescribed->push_back({block.prefix + entry.key, *index});
    places->Add(block.prefix + entry.key, "prescribed joint", PlaceOf(entry));
  }
}

}  // namespace mbv::internal
