#include "model_file/model_drives.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "base/text.h"
#include "model_file/model_names.h"

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
      joint_drive
          ? std::vector<std::string>{"kind", "joint", "coordinate", "range", "range_deg",
                                     "range_mm", "stiffness", "compliance", "gravity_compensation"}
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
  if (joint_drive) ReadCompensation(map, &drive);
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

// What the drive exerts of it is a force along one fixed axis.
void DriveReader::ReadCompensation(const YamlMap& map, Drive* drive) {
  const YamlNode* node = map.Find("gravity_compensation");
  if (node == nullptr) return;
  const std::string path = map.PathOf("gravity_compensation");
  const auto exerts = values_.yaml().Flag(*node, path);
  if (!exerts || !*exerts) return;
  const Joint& joint = joints_.joints[static_cast<size_t>(std::get<JointDrive>(drive->kind).joint)];
  drive->compensates_gravity =
      joint.kind == JointKind::kRevolute || joint.kind == JointKind::kPrismatic;
  if (drive->compensates_gravity) return;
  values_.yaml().Error(
      *node, fmt::format("{}: joint '{}' is {}, a drive that carries gravity compensation "
                         "needs a revolute or prismatic one",
                         path, joint.name, RowOf(joint.kind).word));
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
  const int n = DofsOf(joint.kind);
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

void ReadSymbols(const YamlNode& root, YamlReader* yaml, std::vector<Drive>* drives) {
  const YamlNode* symbols = root.is_map() ? root.Find("symbols") : nullptr;
  if (symbols == nullptr || symbols->is_null()) return;
  std::vector<std::string> names;
  names.reserve(drives->size());
  for (const Drive& drive : *drives) names.push_back(drive.name);
  for (const YamlEntry& entry : yaml->Entries(*symbols, "symbols")) {
    const int d = IndexOf(*drives, entry.key);
    if (d < 0) {
      yaml->Error(entry, fmt::format("symbols: there is no drive '{}'", entry.key),
                  DidYouMean(entry.key, names));
      continue;
    }
    if (const auto text = yaml->Text(*entry.value, JoinPath("symbols", entry.key))) {
      (*drives)[static_cast<size_t>(d)].symbol = *text;
    }
  }
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
    if (DofsOf(joint.kind) != 1) {
      yaml->Error(*node,
                  fmt::format("{}: joint '{}' has {} coordinates, one is needed", map.path(),
                              joint.name, DofsOf(joint.kind)),
                  "split the joint by massless bodies");
      continue;
    }
    prescribed->push_back({block.prefix + entry.key, *index});
    places->Add(block.prefix + entry.key, "prescribed joint", PlaceOf(entry));
  }
}

namespace {

// Generated YAML, with the place of what it stands for.
class NodeMaker {
 public:
  explicit NodeMaker(const YamlNode& at) : at_(at) {}

  using Entries = std::vector<std::pair<std::string, YamlNodePtr>>;

  [[nodiscard]] YamlNodePtr Scalar(const std::string& text) const {
    YamlNode node = Empty(YamlNode::Kind::kScalar);
    node.text = text;
    return std::make_shared<YamlNode>(std::move(node));
  }
  [[nodiscard]] YamlNodePtr List(std::vector<YamlNodePtr> items) const {
    YamlNode node = Empty(YamlNode::Kind::kSequence);
    node.items = std::move(items);
    return std::make_shared<YamlNode>(std::move(node));
  }
  // Without the entries that are null.
  [[nodiscard]] YamlNodePtr Map(const Entries& entries) const {
    YamlNode node = Empty(YamlNode::Kind::kMap);
    for (const auto& [key, value] : entries) {
      if (value == nullptr) continue;
      node.entries.push_back(
          {.key = key, .line = value->line, .column = value->column, .value = value});
    }
    return std::make_shared<YamlNode>(std::move(node));
  }

 private:
  [[nodiscard]] YamlNode Empty(YamlNode::Kind kind) const {
    YamlNode node;
    node.kind = kind;
    node.line = at_.line;
    node.column = at_.column;
    return node;
  }

  const YamlNode& at_;
};

YamlNodePtr Shared(const YamlMap& map, const std::string& key) {
  for (const YamlEntry& entry : map.node()->entries) {
    if (entry.key == key) return entry.value;
  }
  return nullptr;
}

// One leg on its way to a block.
class Leg {
 public:
  Leg(const YamlMap& map, YamlReader* yaml) : map_(map), yaml_(*yaml), make_(*map.node()) {}

  // Null after a finding.
  YamlNodePtr Part() {
    const bool ends = ReadEnds();
    const bool keys = (map_.Required("from") != nullptr) & (map_.Required("to") != nullptr) &
                      (map_.Required("length") != nullptr);
    const YamlNodePtr lower = Half("lower", false), upper = Half("upper", true);
    if (!ends || !keys || lower == nullptr || upper == nullptr) return nullptr;
    const YamlNodePtr drive =
        make_.Map({{"kind", make_.Scalar("joint")}, {"joint", make_.Scalar("slide")}});
    return make_.Map({{"bodies", make_.Map({{"lower", lower}, {"upper", upper}})},
                      {"joints", Joints()},
                      {"drives", make_.Map({{"length", drive}})}});
  }

 private:
  // Two balls let the halves spin about the line, but nothing turns them: they are symmetric about
  // it (mechanism/idle_spins.h).
  bool ReadEnds() {
    const YamlNode* node = map_.Find("ends");
    if (node == nullptr) return true;
    const auto items = yaml_.Items(*node, map_.PathOf("ends"), 2);
    if (!items) return false;
    const std::vector<std::string> kinds = {"universal", "spherical"};
    const auto first = yaml_.Choice(*(*items)[0], map_.PathOf("ends") + "[0]", kinds);
    const auto second = yaml_.Choice(*(*items)[1], map_.PathOf("ends") + "[1]", kinds);
    if (!first || !second) return false;
    universal_first_ = *first == 0;
    universal_last_ = *second == 0;
    if (!universal_first_ || !universal_last_) return true;
    yaml_.Error(*node,
                fmt::format("{}: two ends of kind universal leave the leg no turn about its line",
                            map_.PathOf("ends")),
                "at least one end spherical");
    return false;
  }

  YamlNodePtr Joints() const {
    const YamlNodePtr from = Shared(map_, "from"), to = Shared(map_, "to");
    const YamlNodePtr lower = make_.Scalar("lower"), upper = make_.Scalar("upper");
    YamlNodePtr range = Shared(map_, "range"), range_mm = Shared(map_, "range_mm");
    const YamlNodePtr slide = make_.Map({{"kind", make_.Scalar("prismatic")},
                                         {"parent", lower},
                                         {"child", upper},
                                         {"axis", make_.Scalar("z")},
                                         {"guess", Shared(map_, "length")},
                                         {"range", range},
                                         {"range_mm", range_mm}});
    return make_.Map({{"from", End(from, lower, universal_first_)},
                      {"slide", slide},
                      {"to", End(upper, to, universal_last_)}});
  }

  [[nodiscard]] YamlNodePtr End(const YamlNodePtr& parent, const YamlNodePtr& child,
                                bool universal) const {
    if (!universal) {
      // The first of two balls starts where a universal joint would.
      const bool guessed = child->text == "lower" && !universal_last_;
      return make_.Map({{"kind", make_.Scalar("spherical")},
                        {"parent", parent},
                        {"child", child},
                        {"guess", guessed ? BallGuess("guess") : nullptr},
                        {"guess_deg", guessed ? BallGuess("guess_deg") : nullptr}});
    }
    return make_.Map({{"kind", make_.Scalar("universal")},
                      {"parent", parent},
                      {"child", child},
                      {"axis", make_.Scalar("y")},
                      {"axis2", make_.Scalar("x")},
                      {"guess", Shared(map_, "guess")},
                      {"guess_deg", Shared(map_, "guess_deg")}});
  }

  // Roll, pitch, yaw of the angles about y and then x.
  [[nodiscard]] YamlNodePtr BallGuess(const std::string& key) const {
    const YamlNodePtr angles = Shared(map_, key);
    if (angles == nullptr || angles->items.size() != 2) return angles;
    return make_.List({angles->items[1], angles->items[0], make_.Scalar("0")});
  }

  // A body with its centre of mass on the line; of the upper half counted downwards.
  YamlNodePtr Half(const std::string& key, bool upper) const {
    const YamlNode* node = map_.Find(key);
    if (node == nullptr) return make_.Map({});
    const YamlMap half(&yaml_, node, map_.PathOf(key), {"mass", "com", "along", "across"});
    if (!half.valid()) return nullptr;
    for (const char* needed : {"mass", "com", "along", "across"}) {
      if (half.Required(needed) == nullptr) return nullptr;
    }
    const NodeMaker make(*node);
    YamlNodePtr com = Shared(half, "com");
    if (!com->is_scalar()) return nullptr;
    if (upper) com = NodeMaker(*com).Scalar("-(" + com->text + ")");
    const YamlNodePtr zero = make.Scalar("0"), across = Shared(half, "across");
    return make.Map({{"mass", Shared(half, "mass")},
                     {"com", make.List({zero, zero, com})},
                     {"inertia", make.List({across, across, Shared(half, "along")})},
                     {"shapes", Shapes(make, upper)}});
  }

  // Pictures only.
  [[nodiscard]] YamlNodePtr Shapes(const NodeMaker& make, bool upper) const {
    const YamlNodePtr radius = Shared(map_, "radius"), length = Shared(map_, "length");
    if (radius == nullptr || length == nullptr || !length->is_scalar()) return nullptr;
    const std::string end = fmt::format("{}0.6*({})", upper ? "-" : "", length->text);
    const YamlNodePtr zero = make.Scalar("0");
    const YamlNodePtr thin =
        upper && radius->is_scalar() ? make.Scalar("0.6*(" + radius->text + ")") : radius;
    const YamlNodePtr cylinder = make.Map({{"from", make.List({zero, zero, zero})},
                                           {"to", make.List({zero, zero, make.Scalar(end)})},
                                           {"radius", thin}});
    return make.List(
        {make.Map({{"cylinder", cylinder}, {"color", make.Scalar(upper ? "grey" : "steel")}})});
  }

  const YamlMap& map_;
  YamlReader& yaml_;
  const NodeMaker make_;
  bool universal_first_ = true, universal_last_ = false;
};

void ExpandLeg(const Block& block, const YamlEntry& entry, ModelValues* values,
               ModelBlocks* blocks) {
  YamlReader& yaml = values->yaml();
  const std::string section = block.PathOf("legs");
  if (!IsNewName(entry, section, &yaml)) return;
  if (!HasRoom(*entry.value, blocks->blocks.size(), kMaxBlocks, "legs", &yaml)) return;
  const YamlNode* instances = block.Section("instances");
  if (instances != nullptr && instances->Find(entry.key) != nullptr) {
    yaml.Error(entry, fmt::format("{}.{}: there is an instance of this name", section, entry.key));
    return;
  }
  const YamlMap map(&yaml, entry.value.get(), JoinPath(section, entry.key),
                    {"from", "to", "ends", "length", "range", "range_mm", "guess", "guess_deg",
                     "radius", "lower", "upper"});
  if (!map.valid()) return;
  const YamlNodePtr part = Leg(map, &yaml).Part();
  if (part == nullptr) return;
  blocks->made.push_back(part);
  Block leg = block;
  leg.node = part.get();
  leg.written = false;
  leg.path = map.path();
  leg.prefix = block.prefix + entry.key + ".";
  leg.levels.insert(leg.levels.begin(), leg.prefix);
  blocks->blocks.push_back(std::move(leg));
}

}  // namespace

void ExpandLegs(ModelValues* values, ModelBlocks* blocks) {
  for (size_t b = 0, written = blocks->blocks.size(); b < written; ++b) {
    const Block& block = blocks->blocks[b];
    values->yaml().SetNote(block.Note());
    for (const YamlEntry& entry : block.Entries("legs", &values->yaml())) {
      ExpandLeg(block, entry, values, blocks);
    }
  }
  values->yaml().SetNote("");
}

}  // namespace mbv::internal
