// What elements have of frames on bodies: bushings, and the axes of rotors.
#include <fmt/format.h>

#include "mechanism/joint_kinds.h"
#include "model_file/model_elements.h"

namespace mbv::internal {

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
                    about_axis ? "the joint's parent is the world, which does not turn"
                               : "the coordinate is no angle about an axis of the joint's parent"),
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
