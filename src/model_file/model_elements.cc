#include "model_file/model_elements.h"

#include <fmt/format.h>
#include <algorithm>
#include <map>

#include "base/text.h"
#include "mechanism/joint_kinds.h"
#include "model_file/model_drives.h"

namespace mbv::internal {
namespace {

const std::vector<std::string> kKinds = {"damping", "spring", "rotor", "friction", "bushing"};

// The keys of a kind beside those of its place.
const std::vector<std::string>& KeysOf(const std::string& kind) {
  static const std::map<std::string, std::vector<std::string>> keys = {
      {"damping", {"damping"}},
      {"spring", {"stiffness", "polynomial", "free", "free_deg", "free_mm", "preload"}},
      {"rotor", {"inertia", "ratio", "gyroscopic", "axis_on", "axis"}},
      {"bushing", {"parent", "child", "stiffness", "damping"}},
      {"friction", {"coulomb", "breakaway", "stribeck_rate", "coefficient", "radius"}}};
  return keys.at(kind);
}

}  // namespace

void ElementReader::Read(const Block& block) {
  for (const YamlEntry& entry : block.Entries("elements", &values_.yaml())) {
    ReadElement(block, entry);
  }
}

void ElementReader::ReadElement(const Block& block, const YamlEntry& entry) {
  YamlReader& yaml = values_.yaml();
  const std::string section = block.PathOf("elements");
  if (!IsNewName(entry, section, &yaml)) return;
  if (!HasRoom(*entry.value, elements_.size(), kMaxItems, "elements", &yaml)) return;
  const YamlNode* kind = entry.value->is_map() ? entry.value->Find("kind") : nullptr;
  std::vector<std::string> keys = {"kind"};
  if (kind == nullptr || kind->text != "bushing") {
    keys.insert(keys.end(), {"joint", "coordinate", "drive"});
  }
  for (const std::string& word : kKinds) {
    // Of a kind that is not known, any key is.
    const bool known = kind != nullptr && std::ranges::find(kKinds, kind->text) != kKinds.end();
    if (known && kind->text != word) continue;
    keys.insert(keys.end(), KeysOf(word).begin(), KeysOf(word).end());
  }
  const YamlMap map(&yaml, entry.value.get(), JoinPath(section, entry.key), keys);
  if (!map.valid() || map.Required("kind") == nullptr) return;
  if (!yaml.Choice(*kind, map.PathOf("kind"), kKinds)) return;
  if (kind->text == "bushing") return ReadBushing(block, map, block.prefix + entry.key);
  ForceElement element{.name = block.prefix + entry.key, .law = {}};
  const bool placed = ReadPlace(block, map, &element);
  const JointKind on =
      placed && element.joint >= 0 ? joints_.joints[element.joint].kind : JointKind::kFixed;
  const bool turns_a_ball = IsOfBall(on, element.coordinate);
  if (turns_a_ball && !SuitsBall(map, *kind)) return;
  if (!ReadLaw(block, map, kind->text, placed ? &element : nullptr) || !placed) return;
  if (turns_a_ball) {
    AddOfBall(element, on, &elements_);
  } else {
    elements_.push_back(std::move(element));
  }
}

bool ElementReader::SuitsBall(const YamlMap& map, const YamlNode& kind) {
  YamlReader& yaml = values_.yaml();
  if (kind.text == "spring") {
    yaml.Error(kind, fmt::format("{}: a ball's rotation has no position for a spring", map.path()),
               "kind: bushing, with the joint's frames and stiffness: [0, 0, 0, k, k, k]");
    return false;
  }
  for (const char* key : {"gyroscopic", "axis_on", "axis"}) {
    if (!map.Has(key)) continue;
    yaml.Error(*map.Find(key),
               fmt::format("{}: a ball's rotation has no axis for a rotor", map.PathOf(key)),
               "inertia and ratio alone count for rotations about all axes");
    return false;
  }
  return true;
}

bool ElementReader::ReadPlace(const Block& block, const YamlMap& map, ForceElement* element) {
  YamlReader& yaml = values_.yaml();
  if (map.Has("joint") == map.Has("drive")) {
    yaml.Error(*map.node(), fmt::format("{} needs either joint or drive", map.path()),
               "joint: the joint along whose coordinate it acts; drive: along that drive's");
    return false;
  }
  if (map.Has("drive")) return ReadDrive(block, map, element);
  if (TakeRotation(block, map, element)) return true;
  const auto at = ReadJointCoordinate(joints_, block, map, {}, &yaml);
  if (!at) return false;
  element->joint = at->joint;
  element->coordinate = at->coordinate;
  return true;
}

// All axes of a ball: `coordinate: rotation`, of a spherical joint also without it.
bool ElementReader::TakeRotation(const Block& block, const YamlMap& map, ForceElement* element) {
  const YamlNode* coordinate = map.Find("coordinate");
  if (coordinate != nullptr && coordinate->text != "rotation") return false;
  int joint = -1;
  for (const std::string& level : block.levels) {
    if (joint < 0) joint = joints_.Find(level + map.Find("joint")->text);
  }
  if (joint < 0 || !HasBall(joints_.joints[joint].kind)) return false;
  const JointKind kind = joints_.joints[joint].kind;
  if (coordinate == nullptr && kind != JointKind::kSpherical) return false;
  element->joint = joint;
  element->coordinate = FirstOfBall(kind);
  return true;
}

// A joint drive stands for its coordinate.
bool ElementReader::ReadDrive(const Block& block, const YamlMap& map, ForceElement* element) {
  YamlReader& yaml = values_.yaml();
  const YamlNode& node = *map.Find("drive");
  const auto name = yaml.Text(node, map.PathOf("drive"));
  if (!name) return false;
  if (const YamlNode* coordinate = map.Find("coordinate")) {
    yaml.Error(*coordinate, fmt::format("{}: a drive has one coordinate", map.path()));
    return false;
  }
  int index = -1;
  for (const std::string& level : block.levels) {
    if (index < 0) index = IndexOf(drives_, level + *name);
  }
  if (index < 0) {
    std::vector<std::string> names;
    for (const Drive& drive : drives_) names.push_back(drive.name);
    yaml.Error(node,
               fmt::format("{} = {}: there is no such drive", map.PathOf("drive"), Describe(node)),
               DidYouMean(*name, names));
    return false;
  }
  if (const auto* on = std::get_if<JointDrive>(&drives_[static_cast<size_t>(index)].kind)) {
    element->joint = on->joint;
    element->coordinate = on->coordinate;
  } else {
    element->drive = index;
  }
  return true;
}

// Reads and checks all numbers, also where the place (null) is wrong.
bool ElementReader::ReadLaw(const Block& block, const YamlMap& map, const std::string& kind,
                            ForceElement* element) {
  const auto take = [element](const auto& law) {
    if (law && element != nullptr) element->law = *law;
    return law.has_value();
  };
  if (kind == "damping") return take(ReadDamping(block, map));
  if (kind == "rotor") return take(ReadRotor(block, map, element));
  if (kind == "friction") return take(ReadFriction(block, map, element));
  return take(ReadSpring(block, map, element));
}

std::optional<DampingLaw> ElementReader::ReadDamping(const Block& block, const YamlMap& map) {
  if (map.Required("damping") == nullptr) return std::nullopt;
  const auto damping = NotNegative(block, map, "damping");
  if (!damping) return std::nullopt;
  return DampingLaw{*damping};
}

std::optional<SpringLaw> ElementReader::ReadSpring(const Block& block, const YamlMap& map,
                                                   const ForceElement* element) {
  SpringLaw spring;
  const auto polynomial = ReadPolynomial(block, map);
  std::optional<double> free = 0.0;
  if (element != nullptr) {
    const bool on_joint = element->drive < 0;
    const Joint* joint = on_joint ? &joints_.joints[element->joint] : nullptr;
    free = ReadInCoordinateUnit(
        &values_, block, map, "free", !on_joint || IsLength(joint->kind, element->coordinate),
        on_joint ? joint->name : drives_[static_cast<size_t>(element->drive)].name);
  }
  std::optional<double> preload = 0.0;
  if (map.Has("preload")) preload = values_.Number(block, map, "preload", {kPlain});
  if (!polynomial || !free || !preload) return std::nullopt;
  return SpringLaw{.polynomial = *polynomial, .free = *free, .preload = *preload};
}

// k, k2, …
std::optional<std::vector<double>> ElementReader::ReadPolynomial(const Block& block,
                                                                 const YamlMap& map) {
  YamlReader& yaml = values_.yaml();
  if (map.Has("stiffness") == map.Has("polynomial")) {
    yaml.Error(*map.node(), fmt::format("{} needs either stiffness or polynomial", map.path()),
               "stiffness: force by deflection; polynomial: the coefficients of x, x², x³, x⁴");
    return std::nullopt;
  }
  if (map.Has("stiffness")) {
    const auto stiffness = NotNegative(block, map, "stiffness");
    if (!stiffness) return std::nullopt;
    return std::vector<double>{*stiffness};
  }
  return ReadCoefficients(&values_, block, map, "polynomial");
}

std::optional<RotorLaw> ElementReader::ReadRotor(const Block& block, const YamlMap& map,
                                                 const ForceElement* element) {
  const bool stated = map.Required("inertia") != nullptr;
  const auto inertia = stated ? NotNegative(block, map, "inertia") : std::nullopt;
  std::optional<double> ratio = 1.0;
  if (const YamlNode* node = map.Find("ratio")) {
    ratio = values_.Number(block, map, "ratio", {kPlain});
    if (ratio == 0.0) {
      values_.yaml().Error(*node, fmt::format("{} = 0 turns no rotor", map.PathOf("ratio")),
                           "ratio: the rotor's rate by that of the coordinate");
      return std::nullopt;
    }
  }
  RotorLaw rotor;
  const bool carried = ReadCarrier(block, map, element, &rotor);
  if (!inertia || !ratio || !carried) return std::nullopt;
  rotor.inertia = *inertia;
  rotor.ratio = *ratio;
  return rotor;
}

std::optional<FrictionLaw> ElementReader::ReadFriction(const Block& block, const YamlMap& map,
                                                       const ForceElement* element) {
  const bool loaded = map.Has("coefficient");
  auto law = ReadDry(block, map, loaded);
  const bool fits = !loaded || element == nullptr || FitsLoad(map, *element);
  const auto coefficient = loaded ? NotNegative(block, map, "coefficient") : 0.0;
  const auto radius = ReadJournal(block, map, element);
  if (!law || !fits || !coefficient || !radius) return std::nullopt;
  law->coefficient = *coefficient;
  law->radius = *radius;
  return law;
}

// Only there is it said what carries the load.
bool ElementReader::FitsLoad(const YamlMap& map, const ForceElement& element) {
  const JointKind kind = element.joint < 0 ? JointKind::kFree : joints_.joints[element.joint].kind;
  if (kind == JointKind::kRevolute || kind == JointKind::kPrismatic) return true;
  values_.yaml().Error(*map.Find("coefficient"),
                       fmt::format("{}: friction by the joint's load is known of revolute and "
                                   "prismatic joints only",
                                   map.PathOf("coefficient")),
                       "coulomb: friction whatever the load");
  return false;
}

// A journal has a radius, a guide has none.
std::optional<double> ElementReader::ReadJournal(const Block& block, const YamlMap& map,
                                                 const ForceElement* element) {
  const YamlNode* node = map.Find("radius");
  const bool slides = element != nullptr && element->joint >= 0 &&
                      joints_.joints[element->joint].kind == JointKind::kPrismatic;
  if (node == nullptr && (!map.Has("coefficient") || slides || element == nullptr)) return 1.0;
  if (node != nullptr && map.Has("coefficient") && !slides) {
    return values_.Positive(block, map, "radius", {kPlain});
  }
  const bool lacking = node == nullptr;
  values_.yaml().Error(lacking ? *map.node() : *node,
                       lacking ? fmt::format("{} needs a radius", map.path())
                               : fmt::format("{} has no meaning here", map.PathOf("radius")),
                       "radius: of the journal of a revolute joint whose friction is coefficient "
                       "times radius times its radial load");
  return std::nullopt;
}

std::optional<FrictionLaw> ElementReader::ReadDry(const Block& block, const YamlMap& map,
                                                  bool loaded) {
  YamlReader& yaml = values_.yaml();
  if (loaded && !map.Has("coulomb") && !map.Has("breakaway") && !map.Has("stribeck_rate")) {
    return FrictionLaw{};
  }
  const bool stated = map.Required("coulomb") != nullptr;
  const auto coulomb = stated ? NotNegative(block, map, "coulomb") : std::nullopt;
  if (map.Has("stribeck_rate") && !map.Has("breakaway")) {
    yaml.Error(
        *map.Find("stribeck_rate"), fmt::format("{} needs breakaway as well", map.path()),
        "breakaway: friction at rest; stribeck_rate: how fast it falls to coulomb from there "
        "(left out: at once)");
    return std::nullopt;
  }
  if (!map.Has("breakaway")) {
    if (!coulomb) return std::nullopt;
    return FrictionLaw{.coulomb = *coulomb, .breakaway = *coulomb};
  }
  const auto breakaway = values_.Number(block, map, "breakaway", {kPlain});
  const auto rate = map.Has("stribeck_rate")
                        ? values_.Positive(block, map, "stribeck_rate", {kPlain})
                        : std::optional<double>(0.0);
  if (!coulomb || !breakaway || !rate) return std::nullopt;
  if (*breakaway >= *coulomb) return FrictionLaw{*coulomb, *breakaway, *rate};
  yaml.Error(*map.Find("breakaway"), fmt::format("{} = {} violates breakaway >= coulomb = {}",
                                                 map.PathOf("breakaway"), *breakaway, *coulomb));
  return std::nullopt;
}

std::optional<double> ElementReader::NotNegative(const Block& block, const YamlMap& map,
                                                 const std::string& key) {
  const auto value = values_.Number(block, map, key, {kPlain});
  if (!value || *value >= 0.0) return value;
  values_.yaml().Error(*map.Find(key),
                       fmt::format("{} = {} violates {} >= 0", map.PathOf(key), *value, key));
  return std::nullopt;
}

// What elements have of frames on bodies: bushings, and the axes of rotors.

// `gyroscopic: true`: bearings on the joint's parent, about the joint's axis; `axis_on`, `axis`:
// where they are instead.
bool ElementReader::ReadCarrier(const Block& block, const YamlMap& map, const ForceElement* element,
                                RotorLaw* rotor) {
  YamlReader& yaml = values_.yaml();
  const YamlNode *flag = map.Find("gyroscopic"), *on = map.Find("axis_on"),
                 *axis = map.Find("axis");
  const auto gyroscopic = flag ? yaml.Flag(*flag, map.PathOf("gyroscopic")) : true;
  if (!gyroscopic) return false;
  if ((on == nullptr) != (axis == nullptr) || (on != nullptr && !*gyroscopic)) {
    yaml.Error(
        *map.node(),
        fmt::format("{} needs both axis_on and axis, or neither, and then gyroscopic is true",
                    map.path()),
        "axis_on: the body, or its frame, that the rotor's bearings sit on; axis: there");
    return false;
  }
  if (on == nullptr) {
    if (flag == nullptr || !*gyroscopic || element == nullptr) return true;
    return ReadJointAsCarrier(*flag, map.PathOf("gyroscopic"), *element, rotor);
  }
  const auto frame = names_.Frame(block, *on, map.PathOf("axis_on"));
  const auto direction = values_.Axis(block, *axis, map.PathOf("axis"));
  if (!frame || !direction) return false;
  rotor->carrier = {.body = frame->body, .axis_B = frame->X_BF.linear() * *direction};
  if (frame->body != 0) return true;
  yaml.Error(*on, fmt::format("{} = {}: the world does not turn", map.PathOf("axis_on"), on->text),
             "leave axis_on and axis out: a rotor is without gyroscopic moment then");
  return false;
}

bool ElementReader::ReadJointAsCarrier(const YamlNode& node, const std::string& path,
                                       const ForceElement& element, RotorLaw* rotor) {
  const Joint* joint = element.drive < 0 ? &joints_.joints[element.joint] : nullptr;
  const bool about_axis = joint != nullptr && !IsLength(joint->kind, element.coordinate) &&
                          (element.coordinate == 0 || RowOf(joint->kind).axes == 1);
  if (!about_axis || joint->parent == 0) {
    values_.yaml().Error(
        node,
        fmt::format("{}: {}", path,
                    about_axis
                        ? "the joint's parent is the world, which does not turn"
                        : "the coordinate is not an angle about an axis of the joint's parent"),
        about_axis ? "leave gyroscopic out" : "write axis_on: BODY and axis: [x, y, z] instead");
    return false;
  }
  rotor->carrier = {.body = joint->parent, .axis_B = joint->X_PF.linear() * joint->axis};
  return true;
}

// Six springs and dampers, those that are not zero, along the coordinates of two frames.
void ElementReader::ReadBushing(const Block& block, const YamlMap& map, const std::string& name) {
  YamlReader& yaml = values_.yaml();
  const auto bushing = ReadBushingFrames(block, map);
  const auto stiffness = ReadSix(block, map, "stiffness"), damping = ReadSix(block, map, "damping");
  if (!map.Has("stiffness") && !map.Has("damping")) {
    yaml.Error(*map.node(), fmt::format("{} has neither stiffness nor damping", map.path()),
               "stiffness: [kx, ky, kz, krx, kry, krz]; damping: the same of rates");
    return;
  }
  if (!bushing || !stiffness || !damping) return;
  const auto index = static_cast<int>(bushings_.size());
  bushings_.push_back(*bushing);
  bushings_.back().name = name;
  const auto add = [&](int k, const auto& law) {
    elements_.push_back({.name = "", .coordinate = k, .bushing = index, .law = law});
    elements_.back().name = name + "." + BushingWord(elements_.back());
  };
  for (int k = 0; k < 6; ++k) {
    if ((*stiffness)[k] != 0.0) add(k, SpringLaw{.polynomial = {(*stiffness)[k]}});
    if ((*damping)[k] != 0.0) add(k, DampingLaw{(*damping)[k]});
  }
}

std::optional<Bushing> ElementReader::ReadBushingFrames(const Block& block, const YamlMap& map) {
  const YamlNode *parent = map.Required("parent"), *child = map.Required("child");
  const auto F = parent ? names_.Frame(block, *parent, map.PathOf("parent")) : std::nullopt;
  const auto M = child ? names_.Frame(block, *child, map.PathOf("child")) : std::nullopt;
  if (!F || !M) return std::nullopt;
  if (F->body == M->body) {
    values_.yaml().Error(*child, fmt::format("{}: parent and child are the same body", map.path()));
    return std::nullopt;
  }
  return Bushing{.name = {}, .parent = F->body, .X_PF = F->X_BF, .child = M->body, .X_CM = M->X_BF};
}

// Zeros where the key is left out.
std::optional<Vec6> ElementReader::ReadSix(const Block& block, const YamlMap& map,
                                           const std::string& key) {
  YamlReader& yaml = values_.yaml();
  if (!map.Has(key)) return Vec6::Zero();
  const auto items = yaml.Items(*map.Find(key), map.PathOf(key), 6);
  if (!items) return std::nullopt;
  Vec6 six;
  bool good = true;
  for (int k = 0; k < 6; ++k) {
    const YamlNode& item = *(*items)[static_cast<size_t>(k)];
    const std::string path = fmt::format("{}[{}]", map.PathOf(key), k);
    six[k] = values_.Number(block, item, path).value_or(kNan);
    good = good && six[k] >= 0.0;
    if (six[k] < 0.0) yaml.Error(item, fmt::format("{} = {} violates {} >= 0", path, six[k], key));
  }
  return good ? std::optional(six) : std::nullopt;
}

}  // namespace mbv::internal
