// Joints: kind, frames, axes, guesses, ranges and hints.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model_file/model_reader.h"

namespace mbv {
namespace {

const std::vector<std::string> kJointKeys = {
    "kind",     "parent", "child",     "axis",     "axis2",   "guess",    "guess_deg",
    "guess_mm", "range",  "range_deg", "range_mm", "closure", "transmits"};

std::vector<std::string> KindWords() {
  std::vector<std::string> words;
  for (const JointKindRow& row : kJointKindRows) words.emplace_back(row.word);
  return words;
}

// Of one coordinate when the key carries a unit: _deg is that of angles, _mm of lengths.
UnitSuffix UnitOf(const UnitSuffix& unit, JointKind kind, int coordinate) {
  return unit.Suits(IsLength(kind, coordinate) ? "m" : "rad") ? unit : kPlain;
}

}  // namespace

void ModelReader::ReadJoints(const Block& block) {
  const YamlNode* joints = block.Section("joints");
  if (joints == nullptr) return;
  for (const YamlEntry& entry : yaml_.Entries(*joints, block.PathOf("joints"))) {
    ReadJoint(block, entry);
  }
}

void ModelReader::ReadJoint(const Block& block, const YamlEntry& entry) {
  const std::string path = JoinPath(block.PathOf("joints"), entry.key);
  const bool good_before = joints_good_;
  joints_good_ = false;  // until the end of a good joint
  refused_joints_.insert(block.prefix + entry.key);
  if (!CheckNewName(entry, block.PathOf("joints"))) return;
  if (!Room(*entry.value, mechanism_.joints.size(), kMaxJoints, "joints")) return;
  Joint joint;
  joint.name = block.prefix + entry.key;
  if (mechanism_.FindJoint(joint.name) >= 0) {
    yaml_.Error(entry, fmt::format("{}: a joint '{}' is there already", path, joint.name));
    return;
  }
  const YamlMap map(&yaml_, entry.value.get(), path, kJointKeys);
  if (entry.value->is_null()) {
    yaml_.Error(entry, fmt::format("{}: the joint is not described", path));
    return;
  }
  const YamlNode* kind = map.Required("kind");
  const YamlNode* parent = map.Required("parent");
  const YamlNode* child = map.Required("child");
  const auto choice = kind ? yaml_.Choice(*kind, map.PathOf("kind"), KindWords()) : std::nullopt;
  const auto on_parent = parent ? Frame(block, *parent, map.PathOf("parent")) : std::nullopt;
  const auto on_child = child ? Frame(block, *child, map.PathOf("child")) : std::nullopt;
  bool good = choice && on_parent && on_child;
  if (choice) {
    joint.kind = kJointKindRows[static_cast<size_t>(*choice)].kind;
    good = ReadAxes(block, map, &joint) && good;
    if (const auto guess = map.FindInUnit("guess", {kPlain, kDeg, kMm}); guess.node != nullptr) {
      ReadGuess(block, *guess.node, map.PathOf(guess.key), guess.unit, &joint);
    }
    ReadJointRange(block, map, &joint);
    good = ReadFreeChoices(map, &joint) && good;
  } else if (const YamlNode* axis = map.Find("axis")) {
    (void)Axis(block, *axis, map.PathOf("axis"));  // for its findings
  }
  if (on_parent && on_child && on_parent->body == on_child->body) {
    yaml_.Error(entry, fmt::format("{} connects body '{}' with itself", path,
                                   mechanism_.bodies[on_parent->body].name));
    good = false;
  }
  joints_good_ = good_before && good;
  if (!good) return;
  joint.parent = on_parent->body;
  joint.X_PF = on_parent->X_BF;
  joint.child = on_child->body;
  joint.X_CM = on_child->X_BF;
  std::optional<bool> hint;
  if (const YamlNode* closure = map.Find("closure")) {
    hint = yaml_.Flag(*closure, map.PathOf("closure"));
  }
  mechanism_.joints.push_back(joint);
  hints_.resize(mechanism_.joints.size());
  hints_.back() = hint;
  joint_places_.push_back(&entry);
  refused_joints_.erase(joint.name);
}

bool ModelReader::ReadAxes(const Block& block, const YamlMap& map, Joint* joint) {
  bool good = true;
  const auto read = [&](const char* key, bool needed, Vec3* axis) {
    const YamlNode* node = map.Find(key);
    if (needed && node == nullptr) {
      (void)map.Required(key);
      good = false;
    } else if (!needed && node != nullptr) {
      yaml_.Error(*node,
                  fmt::format("{}: a {} joint has no {}", map.path(), WordOf(joint->kind), key));
      good = false;
    } else if (needed) {
      const auto value = Axis(block, *node, map.PathOf(key));
      good = good && value.has_value();
      if (value) *axis = *value;
    }
  };
  const int axes = RowOf(joint->kind).axes;
  read("axis", axes > 0, &joint->axis);
  read("axis2", axes > 1, &joint->axis2);
  if (!good || axes < 2) return good;
  // At zero coordinates the two joint frames coincide, so the components can be compared.
  if (joint->axis.cross(joint->axis2).norm() > 1e-6) return true;
  yaml_.Error(*map.Find("axis2"), fmt::format("{}: axis and axis2 are parallel", map.path()),
              "a universal joint needs two different axes");
  return false;
}

void ModelReader::ReadGuess(const Block& block, const YamlNode& node, const std::string& path,
                            const UnitSuffix& unit, Joint* joint) {
  const int n = FreedomsOf(joint->kind);
  if (n == 1 && node.is_scalar()) {
    joint->guess[0] = Number(block, node, path, UnitOf(unit, joint->kind, 0)).value_or(0.0);
    WarnAboutGuess(node, path, unit, *joint, 0);
    return;
  }
  const auto items = yaml_.Items(node, path, n);
  if (!items) return;
  for (int k = 0; k < n; ++k) {
    joint->guess[k] =
        Number(block, *(*items)[k], fmt::format("{}[{}]", path, k), UnitOf(unit, joint->kind, k))
            .value_or(0.0);
    WarnAboutGuess(*(*items)[k], fmt::format("{}[{}]", path, k), unit, *joint, k);
  }
}

// More than a turn is no guess; degrees are.
void ModelReader::WarnAboutGuess(const YamlNode& node, const std::string& path,
                                 const UnitSuffix& unit, const Joint& joint, int k) {
  const double guess = joint.guess[static_cast<size_t>(k)];
  if (IsLength(joint.kind, k) || unit.suffix == kDeg.suffix) return;
  if (std::abs(guess) <= 2.0 * std::numbers::pi) return;
  yaml_.Warn(node, fmt::format("{} = {:.6g} rad is more than a turn", path, guess),
             "angles are in radians; write guess_deg for degrees");
}

void ModelReader::ReadJointRange(const Block& block, const YamlMap& map, Joint* joint) {
  const YamlMap::InUnit range = map.FindInUnit("range", {kPlain, kDeg, kMm});
  if (range.node == nullptr) return;
  const std::string path = map.PathOf(range.key);
  const int n = FreedomsOf(joint->kind);
  const bool one_pair = n == 1 && range.node->is_sequence() && !range.node->items.empty() &&
                        !range.node->items.front()->is_sequence();
  if (one_pair) {
    joint->range[0] = Range(block, *range.node, path, UnitOf(range.unit, joint->kind, 0))
                          .value_or(CoordinateRange{});
    return;
  }
  const auto items = yaml_.Items(*range.node, path, n);
  if (!items) return;
  for (int k = 0; k < n; ++k) {
    joint->range[k] = Range(block, *(*items)[k], fmt::format("{}[{}]", path, k),
                            UnitOf(range.unit, joint->kind, k))
                          .value_or(CoordinateRange{});
  }
}

bool ModelReader::ReadFreeChoices(const YamlMap& map, Joint* joint) {
  const YamlNode* transmits = map.Find("transmits");
  if (transmits == nullptr) return true;
  const auto choice = yaml_.Choice(*transmits, map.PathOf("transmits"), {"all", "force"});
  if (!choice) return false;
  joint->transmits_force_only = *choice == 1;
  if (*choice == 0 || RowOf(joint->kind).may_transmit_force_only) return true;
  yaml_.Error(
      *transmits,
      fmt::format("{}: a {} joint cannot transmit a force only", map.path(), WordOf(joint->kind)),
      "only revolute, universal and spherical joints can");
  return false;
}

}  // namespace mbv
