#include "model_file/model_couplings.h"

#include <fmt/format.h>

#include <algorithm>

#include "mechanism/joint_pose.h"
#include "model_file/model_drives.h"

namespace mbv::internal {

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

}  // namespace mbv::internal
