#include "model_file/model_joints.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mechanism/joint_pose.h"
#include "model_file/model_bodies.h"
#include "model_file/model_drives.h"

namespace mbv::internal {
namespace {

const std::vector<std::string> kJointKeys = {
    "kind",  "parent",    "child",    "axis",    "axis2",     "guess", "guess_deg", "guess_mm",
    "range", "range_deg", "range_mm", "closure", "transmits", "lead",  "lead_mm"};

// A cylindrical joint whose travel follows its turn.
constexpr const char* kHelical = "helical";

std::vector<std::string> KindWords() {
  std::vector<std::string> words;
  words.reserve(kJointKindRows.size() + 1);
  for (const JointKindRow& row : kJointKindRows) words.emplace_back(row.word);
  words.emplace_back(kHelical);
  return words;
}

bool IsHelical(size_t choice) { return choice >= kJointKindRows.size(); }

JointKind KindOf(size_t choice) {
  return IsHelical(choice) ? JointKind::kCylindrical : kJointKindRows.at(choice).kind;
}

// The joint must be the next one.
Coupling ScrewOf(const std::string& joint, size_t index, double lead) {
  const auto j = static_cast<int>(index);
  return {.name = joint + ".lead",
          .terms = {{.joint = j, .coordinate = 0, .polynomial = {-1.0}},
                    {.joint = j, .coordinate = 1, .polynomial = {lead / (2 * std::numbers::pi)}}}};
}

// Of one coordinate when the key carries a unit: _deg is that of angles, _mm of lengths.
UnitSuffix UnitOf(const UnitSuffix& unit, JointKind kind, int coordinate) {
  return unit.Suits(IsLength(kind, coordinate) ? "m" : "rad") ? unit : kPlain;
}

// A travel alone implies the turn, a turn (guess_deg) alone the travel.
void ReadScrewGuess(const Block& block, const YamlMap& map, const YamlMap::InUnit& guess,
                    double lead, ModelValues* values, Joint* joint) {
  const auto value = values->Number(block, *guess.node, map.PathOf(guess.key), guess.unit);
  const double per_turn = lead / (2 * std::numbers::pi);
  const bool turn = guess.unit.suffix == kDeg.suffix;
  joint->guess[0] = value.value_or(0.0) * (turn ? per_turn : 1.0);
  joint->guess[1] = joint->guess[0] / per_turn;
}

// More than a turn is not a guess; degrees are.
void WarnAboutGuess(const YamlNode& node, const std::string& path, const UnitSuffix& unit,
                    const Joint& joint, int k, ModelValues* values) {
  const double guess = joint.guess[static_cast<size_t>(k)];
  if (IsLength(joint.kind, k) || unit.suffix == kDeg.suffix) return;
  if (std::abs(guess) <= 2.0 * std::numbers::pi) return;
  values->UseUnknown();
  values->yaml().Warn(node, fmt::format("{} = {:.6g} rad is more than a turn", path, guess),
                      "angles are in radians; write guess_deg for degrees");
}

// Whether the joint is to be cut.
std::optional<bool> HintOf(const YamlMap& map, YamlReader* yaml) {
  const YamlNode* closure = map.Find("closure");
  return closure == nullptr ? std::nullopt : yaml->Flag(*closure, map.PathOf("closure"));
}

}  // namespace

void ModelJoints::Add(Joint joint, Place place, std::optional<bool> hint) {
  joints.push_back(std::move(joint));
  places.push_back(place);
  hints.push_back(hint);
}

void JointReader::Read(const Block& block) {
  for (const YamlEntry& entry : block.Entries("joints", &values_.yaml())) {
    auto read =
        values_.Item<JointRead>(block, *entry.value, [&] { return ReadJoint(block, entry); });
    if (read) AddJoint(*std::move(read), PlaceOf(entry));
  }
}

void JointReader::AddJoint(JointRead read, Place place) {
  const size_t index = joints_.joints.size();
  if (read.guessed) joints_.guessed.insert(static_cast<int>(index));
  if (read.lead) joints_.screws.push_back(ScrewOf(read.joint.name, index, *read.lead));
  joints_.Add(std::move(read.joint), place, read.hint);
}

// Neither one too many, nor there already.
bool JointReader::IsFresh(const YamlEntry& entry, const std::string& path,
                          const std::string& name) {
  YamlReader& yaml = values_.yaml();
  if (!HasRoom(*entry.value, joints_.joints.size(), kMaxJoints, "joints", &yaml)) return false;
  if (joints_.Find(name) < 0) return true;
  yaml.Error(entry, fmt::format("{}: a joint '{}' is there already", path, name));
  return false;
}

std::optional<JointReader::JointRead> JointReader::ReadJoint(const Block& block,
                                                             const YamlEntry& entry) {
  YamlReader& yaml = values_.yaml();
  const std::string path = JoinPath(block.PathOf("joints"), entry.key);
  const bool good_before = joints_.good;
  joints_.good = false;  // until the end of a good joint
  Joint joint;
  joint.name = block.prefix + entry.key;
  joints_.refused.insert(joint.name);
  if (!IsNewName(entry, block.PathOf("joints"), &yaml) || !IsFresh(entry, path, joint.name)) {
    return std::nullopt;
  }
  const YamlMap map(&yaml, entry.value.get(), path, kJointKeys);
  if (entry.value->is_null()) {
    yaml.Error(entry, fmt::format("{}: the joint is not described", path));
    return std::nullopt;
  }
  const YamlNode* kind = map.Required("kind");
  const YamlNode* parent = map.Required("parent");
  const YamlNode* child = map.Required("child");
  const auto choice = kind ? ReadKind(*kind, map.PathOf("kind"), KindWords(), &yaml) : std::nullopt;
  const auto on_parent = parent ? names_.Frame(block, *parent, map.PathOf("parent")) : std::nullopt;
  const auto on_child = child ? names_.Frame(block, *child, map.PathOf("child")) : std::nullopt;
  bool good = choice && on_parent && on_child;
  std::optional<double> lead;
  if (choice) {
    joint.kind = KindOf(static_cast<size_t>(*choice));
    const bool helical = IsHelical(static_cast<size_t>(*choice));
    lead = ReadLead(block, map, helical);
    good = ReadCoordinates(block, map, lead, &joint) && lead.has_value() == helical && good;
  } else if (const YamlNode* axis = map.Find("axis")) {
    (void)values_.Axis(block, *axis, map.PathOf("axis"));  // for its findings
  }
  if (on_parent && on_child && on_parent->body == on_child->body) {
    yaml.Error(entry, fmt::format("{} connects body '{}' with itself", path,
                                  bodies_.bodies[on_parent->body].name));
    good = false;
  }
  joints_.good = good_before && good;
  if (!good) return std::nullopt;
  joint.parent = on_parent->body;
  joint.X_PF = on_parent->X_BF;
  joint.child = on_child->body;
  joint.X_CM = on_child->X_BF;
  joints_.refused.erase(joint.name);
  return JointRead{.joint = std::move(joint),
                   .lead = lead,
                   .hint = HintOf(map, &yaml),
                   .guessed = map.Has("guess") || map.Has("guess_deg") || map.Has("guess_mm")};
}

// What depends on the kind.
bool JointReader::ReadCoordinates(const Block& block, const YamlMap& map,
                                  std::optional<double> lead, Joint* joint) {
  const bool good = ReadAxes(block, map, joint);
  const YamlMap::InUnit guess = map.FindInUnit("guess", {kPlain, kDeg, kMm});
  if (guess.node != nullptr && lead && guess.node->is_scalar()) {
    ReadScrewGuess(block, map, guess, *lead, &values_, joint);
  } else if (guess.node != nullptr) {
    ReadGuess(block, *guess.node, map.PathOf(guess.key), guess.unit, &values_, joint);
  }
  ReadRange(block, map, joint);
  return ReadFreeChoices(map, joint) && good;
}

// Of a helical joint [m per turn]; empty for others, and after a finding.
std::optional<double> JointReader::ReadLead(const Block& block, const YamlMap& map, bool helical) {
  const YamlMap::InUnit lead = map.FindInUnit("lead", {kPlain, kMm});
  if (!helical && lead.node != nullptr) {
    values_.yaml().Error(*lead.node,
                         fmt::format("{}: only helical joints have a lead", map.path()));
  }
  if (helical && lead.node == nullptr) (void)map.Required("lead");
  if (!helical || lead.node == nullptr) return std::nullopt;
  const auto value = values_.Number(block, *lead.node, map.PathOf(lead.key), lead.unit);
  if (!value || *value != 0.0) return value;
  values_.yaml().Error(*lead.node,
                       fmt::format("{} = 0: the joint would not travel", map.PathOf(lead.key)),
                       "a joint that only turns is revolute");
  return std::nullopt;
}

bool JointReader::ReadAxes(const Block& block, const YamlMap& map, Joint* joint) {
  bool good = true;
  const auto read = [&](const char* key, bool needed, Vec3* axis) {
    const YamlNode* node = map.Find(key);
    if (needed && node == nullptr) {
      (void)map.Required(key);
      good = false;
    } else if (!needed && node != nullptr) {
      values_.yaml().Error(
          *node, fmt::format("{}: a {} joint has no {}", map.path(), WordOf(joint->kind), key));
      good = false;
    } else if (needed) {
      const auto value = values_.Axis(block, *node, map.PathOf(key));
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
  values_.yaml().Error(*map.Find("axis2"),
                       fmt::format("{}: axis and axis2 are parallel", map.path()),
                       "a universal joint needs two different axes");
  return false;
}

void JointReader::ReadRange(const Block& block, const YamlMap& map, Joint* joint) {
  const YamlMap::InUnit range = map.FindInUnit("range", {kPlain, kDeg, kMm});
  if (range.node == nullptr) return;
  const std::string path = map.PathOf(range.key);
  const int n = DofsOf(joint->kind);
  const bool one_pair = n == 1 && range.node->is_sequence() && !range.node->items.empty() &&
                        !range.node->items.front()->is_sequence();
  const bool of_ball = joint->kind == JointKind::kSpherical && range.node->items.size() == 2 &&
                       !range.node->items.front()->is_sequence();
  if (of_ball) return ReadRotationRange(block, *range.node, path, range.unit, joint);
  if (one_pair) {
    joint->range[0] = values_.Range(block, *range.node, path, UnitOf(range.unit, joint->kind, 0))
                          .value_or(CoordinateRange{});
    return;
  }
  const auto items = values_.yaml().Items(*range.node, path, n);
  if (!items) return;
  for (int k = 0; k < n; ++k) {
    joint->range[k] = values_
                          .Range(block, *(*items)[k], fmt::format("{}[{}]", path, k),
                                 UnitOf(range.unit, joint->kind, k))
                          .value_or(CoordinateRange{});
  }
}

// [0, the largest angle], about any axis.
void JointReader::ReadRotationRange(const Block& block, const YamlNode& node,
                                    const std::string& path, const UnitSuffix& unit, Joint* joint) {
  const auto range = values_.Range(block, node, path, UnitOf(unit, joint->kind, 0));
  if (!range) return;
  if (range->lower == 0.0 && range->upper > 0.0) {
    joint->max_rotation = range->upper;
    return;
  }
  values_.yaml().Error(
      node, fmt::format("{}: the range of a ball's rotation begins at 0", path),
      "[0, the largest angle about any axis], or three ranges of roll, pitch, yaw");
}

bool JointReader::ReadFreeChoices(const YamlMap& map, Joint* joint) {
  const YamlNode* transmits = map.Find("transmits");
  if (transmits == nullptr) return true;
  const auto choice = values_.yaml().Choice(*transmits, map.PathOf("transmits"), {"all", "force"});
  if (!choice) return false;
  joint->transmits_force_only = *choice == 1;
  if (*choice == 0 || RowOf(joint->kind).may_transmit_force_only) return true;
  values_.yaml().Error(
      *transmits,
      fmt::format("{}: a {} joint cannot transmit a force only", map.path(), WordOf(joint->kind)),
      "only revolute, universal and spherical joints can");
  return false;
}

void ReadGuess(const Block& block, const YamlNode& node, const std::string& path,
               const UnitSuffix& unit, ModelValues* values, Joint* joint) {
  const int n = DofsOf(joint->kind);
  if (n == 1 && node.is_scalar()) {
    joint->guess[0] = values->Number(block, node, path, UnitOf(unit, joint->kind, 0)).value_or(0.0);
    WarnAboutGuess(node, path, unit, *joint, 0, values);
    return;
  }
  const auto items = values->yaml().Items(node, path, n);
  if (!items) return;
  for (int k = 0; k < n; ++k) {
    joint->guess[k] = values
                          ->Number(block, *(*items)[k], fmt::format("{}[{}]", path, k),
                                   UnitOf(unit, joint->kind, k))
                          .value_or(0.0);
    WarnAboutGuess(*(*items)[k], fmt::format("{}[{}]", path, k), unit, *joint, k, values);
  }
}

void CouplingReader::Read(const Block& block) {
  for (const YamlEntry& entry : block.Entries("couplings", &values_.yaml())) {
    ReadCoupling(block, entry);
  }
}

void CouplingReader::TakeScrews() {
  for (const Coupling& screw : joints_.screws) {
    places_.Add(screw.name, "coupling", joints_.places[static_cast<size_t>(screw.terms[0].joint)]);
    couplings_.push_back(screw);
  }
}

void CouplingReader::ReadCoupling(const Block& block, const YamlEntry& entry) {
  YamlReader& yaml = values_.yaml();
  const std::string section = block.PathOf("couplings");
  if (!IsNewName(entry, section, &yaml)) return;
  if (!HasRoom(*entry.value, couplings_.size(), kMaxItems, "couplings", &yaml)) return;
  const bool sum = entry.value->is_map() && entry.value->Find("sum") != nullptr;
  const YamlMap map(
      &yaml, entry.value.get(), JoinPath(section, entry.key),
      sum ? std::vector<std::string>{"sum", "offset", "offset_deg", "offset_mm"}
          : std::vector<std::string>{"joint", "coordinate", "follows", "follows_coordinate",
                                     "ratio", "polynomial", "offset", "offset_deg", "offset_mm"});
  if (!map.valid()) return;
  Coupling coupling{.name = block.prefix + entry.key, .terms = {}};
  if (!(sum ? ReadSum(block, map, &coupling) : ReadFollower(block, map, &coupling))) return;
  places_.Add(coupling.name, "coupling", PlaceOf(entry));
  couplings_.push_back(std::move(coupling));
}

// q_joint = offset + ratio q_follows, or a polynomial of it.
bool CouplingReader::ReadFollower(const Block& block, const YamlMap& map, Coupling* coupling) {
  YamlReader& yaml = values_.yaml();
  auto joint = Coordinate(block, map, "joint");
  auto followed = Coordinate(block, map, "follows");
  if (!joint || !followed) return false;
  joint->polynomial = {-1.0};
  coupling->terms = {*joint};
  if (!IsNew(*coupling, *followed, *map.Find("follows"), map)) return false;
  if (map.Has("ratio") == map.Has("polynomial")) {
    yaml.Error(*map.node(), fmt::format("{} needs either ratio or polynomial", map.path()),
               "ratio: rate of the joint by the rate of what it follows; polynomial: the "
               "coefficients of q, q², q³, q⁴");
    return false;
  }
  const std::string key = map.Has("ratio") ? "ratio" : "polynomial";
  const YamlNode& node = *map.Find(key);
  const auto coefficients = ReadCoefficients(&values_, block, map, key);
  if (!coefficients) return false;
  followed->polynomial = *coefficients;
  if (std::ranges::all_of(followed->polynomial, [](double c) { return c == 0.0; })) {
    yaml.Error(node, fmt::format("{} = 0 couples nothing", map.PathOf(key)),
               "to hold a joint, make it fixed or prescribed");
    return false;
  }
  while (followed->polynomial.back() == 0.0) followed->polynomial.pop_back();
  coupling->terms.push_back(*followed);
  const auto offset = Offset(block, map, *joint);
  coupling->constant = offset.value_or(0.0);
  return offset.has_value();
}

// Σ factor · q = offset.
bool CouplingReader::ReadSum(const Block& block, const YamlMap& map, Coupling* coupling) {
  YamlReader& yaml = values_.yaml();
  const auto items = yaml.Items(*map.Find("sum"), map.PathOf("sum"));
  if (!items) return false;
  for (size_t i = 0; i < items->size(); ++i) {
    const YamlMap term(&yaml, (*items)[i], fmt::format("{}[{}]", map.PathOf("sum"), i),
                       {"joint", "coordinate", "factor"});
    if (!term.valid()) return false;
    auto at = Coordinate(block, term, "joint");
    const auto factor = term.Required("factor") == nullptr
                            ? std::nullopt
                            : values_.Number(block, term, "factor", {kPlain});
    if (!at || !factor || !IsNew(*coupling, *at, *(*items)[i], term)) return false;
    if (*factor == 0.0) {
      yaml.Error(*term.Find("factor"),
                 fmt::format("{} = 0 couples nothing", term.PathOf("factor")));
      return false;
    }
    at->polynomial = {*factor};
    coupling->terms.push_back(*at);
  }
  if (coupling->terms.size() < 2) {
    yaml.Error(*map.Find("sum"),
               fmt::format("{} has {} term{}, at least 2 are needed", map.PathOf("sum"),
                           coupling->terms.size(), coupling->terms.size() == 1 ? "" : "s"));
    return false;
  }
  const auto offset = Offset(block, map, coupling->terms.front());
  coupling->constant = -offset.value_or(0.0);
  return offset.has_value();
}

std::optional<Coupling::Term> CouplingReader::Coordinate(const Block& block, const YamlMap& map,
                                                         const std::string& key) {
  const auto at = ReadJointCoordinate(joints_, block, map,
                                      {key, key == "joint" ? "coordinate" : key + "_coordinate"},
                                      &values_.yaml());
  if (!at) return std::nullopt;
  return Coupling::Term{.joint = at->joint, .coordinate = at->coordinate, .polynomial = {}};
}

// In the unit of a coordinate; empty after a finding.
std::optional<double> CouplingReader::Offset(const Block& block, const YamlMap& map,
                                             const Coupling::Term& of) {
  const Joint& joint = joints_.joints[of.joint];
  return ReadInCoordinateUnit(&values_, block, map, "offset", IsLength(joint.kind, of.coordinate),
                              joint.name);
}

bool CouplingReader::IsNew(const Coupling& coupling, const Coupling::Term& term, const YamlNode& at,
                           const YamlMap& map) {
  for (const Coupling::Term& other : coupling.terms) {
    if (other.joint != term.joint || other.coordinate != term.coordinate) continue;
    values_.yaml().Error(
        at, fmt::format("{}: coordinate {} of joint '{}' stands in it twice", map.path(),
                        term.coordinate, joints_.joints[term.joint].name));
    return false;
  }
  return true;
}

std::optional<int> ReadKind(const YamlNode& kind, const std::string& path,
                            const std::vector<std::string>& words, YamlReader* yaml) {
  struct Inexpressible {
    const char* what;
    const char* hint;
    std::vector<std::string> words;
  };
  static const std::vector<Inexpressible> rows = {
      {"rolling without slip constrains velocities alone, and constraints here are those of "
       "positions",
       "a wheel that rolls along a line is a coupling of its angle with the way: couplings: {NAME: "
       "{joint: way, follows: wheel, ratio: radius}}",
       {"rolling", "rolling_wheel", "wheel", "roll"}},
      {"a cable that goes slack is no joint",
       "elements: {kind: curve, from: A, to: B, points: [[0, 0], [L, 0], [L + 1, -k]], "
       "interpolation: linear, beyond: linear} pulls beyond the length L only",
       {"cable", "rope", "wire", "slack_cable", "pulley"}},
      {"a belt that slips is no coupling",
       "a shaft behind a second revolute joint with friction slips on it: elements: {kind: "
       "friction, "
       "joint: slip, coulomb: M}; without slip: couplings",
       {"belt", "v_belt", "vbelt"}}};
  for (const Inexpressible& row : rows) {
    if (std::ranges::find(row.words, kind.text) == row.words.end()) continue;
    yaml->Error(kind, fmt::format("{} = {} is not expressible: {}", path, kind.text, row.what),
                row.hint);
    return std::nullopt;
  }
  return yaml->Choice(kind, path, words);
}

}  // namespace mbv::internal
