#include "model_file/model_elements.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>

#include "base/text.h"
#include "mechanism/joint_kinds.h"
#include "model_file/model_drives.h"

namespace mbv::internal {
namespace {

const std::vector<std::string> kKinds = {"damping", "spring", "rotor",      "friction",
                                         "stop",    "curve",  "expression", "bushing"};

constexpr std::initializer_list<UnitSuffix> kSlopes = {kPlain, kPerMm, kPerDeg};

// The keys of a kind beside those of its place.
const std::vector<std::string>& KeysOf(const std::string& kind) {
  static const std::map<std::string, std::vector<std::string>> keys = {
      {"damping", {"damping", "damping_per_mm", "damping_per_deg"}},
      {"spring",
       {"stiffness", "stiffness_per_mm", "stiffness_per_deg", "polynomial", "free", "free_deg",
        "free_mm", "preload"}},
      {"rotor", {"inertia", "inertia_kg_cm2", "ratio", "gyroscopic", "axis_on", "axis"}},
      {"stop",
       {"lower", "lower_deg", "lower_mm", "upper", "upper_deg", "upper_mm", "stiffness",
        "stiffness_per_mm", "stiffness_per_deg", "exponent", "damping", "damping_per_mm",
        "damping_per_deg", "dissipation", "restitution"}},
      {"curve",
       {"of", "points", "points_deg", "points_mm", "points_rpm", "interpolation", "beyond",
        "slopes", "rates", "rates_rpm", "beyond_rates"}},
      {"expression", {"force"}},
      {"bushing", {"parent", "child", "stiffness", "damping"}},
      {"friction",
       {"coulomb", "breakaway", "stribeck_rate", "coefficient", "radius", "radius_mm", "length",
        "length_mm", "thrust_radius", "thrust_radius_mm", "coupling", "efficiency",
        "efficiency_back", "coefficient_back", "resists"}}};
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
    keys.insert(keys.end(), {"joint", "coordinate", "drive", "spring", "from", "to"});
  }
  for (const std::string& word : kKinds) {
    // Of a kind that is not known, any key is.
    const bool known = kind != nullptr && std::ranges::find(kKinds, kind->text) != kKinds.end();
    if (known && kind->text != word) continue;
    keys.insert(keys.end(), KeysOf(word).begin(), KeysOf(word).end());
  }
  const YamlMap map(&yaml, entry.value.get(), JoinPath(section, entry.key), keys);
  if (!map.valid() || map.Required("kind") == nullptr) return;
  if (!ReadKind(*kind, map.PathOf("kind"), kKinds, &yaml)) return;
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
  if (kind.text == "spring" || kind.text == "stop" || kind.text == "curve" ||
      kind.text == "expression") {
    yaml.Error(kind,
               fmt::format("{}: a ball's rotation has no position for a {}", map.path(), kind.text),
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
  const bool points = map.Has("from") || map.Has("to");
  if (map.Has("joint") + map.Has("drive") + map.Has("spring") + points != 1) {
    yaml.Error(*map.node(),
               fmt::format("{} needs one of joint, drive, spring, and from with to", map.path()),
               "joint: the joint along whose coordinate it acts; drive: along that drive's; "
               "spring: along its length; from, to: along the distance of two frames");
    return false;
  }
  if (map.Has("drive")) return ReadDrive(block, map, element);
  if (map.Has("spring") || points) return ReadSpringPlace(block, map, element);
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

// Between two points acts a spring without stiffness, which has the element's name.
bool ElementReader::ReadSpringPlace(const Block& block, const YamlMap& map, ForceElement* element) {
  YamlReader& yaml = values_.yaml();
  if (const YamlNode* coordinate = map.Find("coordinate")) {
    yaml.Error(*coordinate, fmt::format("{}: a distance is one coordinate", map.path()));
    return false;
  }
  if (!map.Has("spring")) {
    SpringDamper between{.name = element->name};
    if (!names_.Ends(block, map, &between)) return false;
    if (IndexOf(springs_, between.name) >= 0) {
      yaml.Error(*map.node(),
                 fmt::format("{}: there is a spring '{}' already", map.path(), between.name),
                 "give the element another name, or let it act along that spring: spring: NAME");
      return false;
    }
    element->spring = static_cast<int>(springs_.size());
    springs_.push_back(std::move(between));
    return true;
  }
  element->spring =
      FindNamed(springs_, "spring", block, *map.Find("spring"), map.PathOf("spring"), &yaml);
  return element->spring >= 0;
}

// A joint drive stands for its coordinate.
bool ElementReader::ReadDrive(const Block& block, const YamlMap& map, ForceElement* element) {
  YamlReader& yaml = values_.yaml();
  if (const YamlNode* coordinate = map.Find("coordinate")) {
    yaml.Error(*coordinate, fmt::format("{}: a drive has one coordinate", map.path()));
    return false;
  }
  const int index =
      FindNamed(drives_, "drive", block, *map.Find("drive"), map.PathOf("drive"), &yaml);
  if (index < 0) return false;
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
  if (kind == "damping") return take(ReadDamping(block, map, element));
  if (kind == "rotor" && element != nullptr && element->spring >= 0) {
    values_.yaml().Error(*map.node(), fmt::format("{}: a distance turns no rotor", map.path()),
                         "joint: or drive: along whose coordinate the rotor turns");
    return false;
  }
  if (kind == "rotor") return take(ReadRotor(block, map, element));
  if (kind == "friction") return take(ReadFriction(block, map, element));
  if (kind == "stop") return take(ReadStop(block, map, element));
  if (kind == "curve") {
    const YamlNode* of = map.Find("of");
    if (of != nullptr && of->text == "both") return take(ReadCurves(block, map, element));
    return take(ReadCurve(block, map, element));
  }
  if (kind == "expression") return take(ReadExpression(block, map));
  return take(ReadSpring(block, map, element));
}

bool ElementReader::IsAlongLength(const ForceElement& element) const {
  return element.joint < 0 || IsLength(joints_.joints[element.joint].kind, element.coordinate);
}

std::string ElementReader::NameOf(const ForceElement& element) const {
  if (element.joint >= 0) return joints_.joints[element.joint].name;
  return element.drive >= 0 ? drives_[static_cast<size_t>(element.drive)].name
                            : springs_[static_cast<size_t>(element.spring)].name;
}

// Per metre or radian, or per millimetre or degree; at least 0, and required.
std::optional<double> ElementReader::Slope(const Block& block, const YamlMap& map,
                                           const std::string& key, const ForceElement* element) {
  const auto found = map.FindInUnit(key, kSlopes);
  if (found.node != nullptr && element != nullptr &&
      !found.unit.Suits(IsAlongLength(*element) ? "m" : "rad")) {
    values_.yaml().Error(
        *found.node,
        fmt::format("{}: the coordinate of '{}' is {}", map.PathOf(found.key), NameOf(*element),
                    IsAlongLength(*element) ? "a length" : "an angle"));
    return std::nullopt;
  }
  return NotNegative(block, map, key, kSlopes);
}

std::optional<DampingLaw> ElementReader::ReadDamping(const Block& block, const YamlMap& map,
                                                     const ForceElement* element) {
  const auto damping = Slope(block, map, "damping", element);
  if (!damping) return std::nullopt;
  return DampingLaw{*damping};
}

std::optional<StopLaw> ElementReader::ReadStop(const Block& block, const YamlMap& map,
                                               const ForceElement* element) {
  YamlReader& yaml = values_.yaml();
  StopLaw stop;
  bool good = true;
  const auto end = [&](const char* key, double* limit) {
    if (map.FindInUnit(key, {kPlain, kDeg, kMm}).node == nullptr) return false;
    const auto at = element == nullptr
                        ? std::optional(0.0)
                        : ReadInCoordinateUnit(&values_, block, map, key, IsAlongLength(*element),
                                               NameOf(*element));
    good = good && at.has_value();
    *limit = at.value_or(kNan);
    return true;
  };
  const bool has_lower = end("lower", &stop.lower), has_upper = end("upper", &stop.upper);
  if (!has_lower && !has_upper) {
    yaml.Error(*map.node(), fmt::format("{} needs lower, upper, or both", map.path()),
               "coordinates at which the stop begins to push back");
    good = false;
  } else if (good && element != nullptr && !(stop.lower < stop.upper)) {
    yaml.Error(*map.node(), fmt::format("{}: lower = {} violates lower < upper = {}", map.path(),
                                        stop.lower, stop.upper));
    good = false;
  }
  if (map.Has("restitution")) return ReadRigid(block, map, stop, good);
  const auto stiffness = Slope(block, map, "stiffness", element);
  if (stiffness && *stiffness == 0.0) {
    yaml.Error(*map.node(), fmt::format("{}: stiffness = 0 stops nothing", map.path()));
    good = false;
  }
  const auto exponent =
      map.Has("exponent") ? values_.Number(block, map, "exponent", {kPlain}) : 1.0;
  if (exponent && !(*exponent >= 1.0)) {
    yaml.Error(*map.Find("exponent"),
               fmt::format("{} = {} violates exponent >= 1", map.PathOf("exponent"), *exponent));
    good = false;
  }
  const bool damps = map.FindInUnit("damping", kSlopes).node != nullptr;
  const auto damping = damps ? Slope(block, map, "damping", element) : 0.0;
  const auto dissipation = map.Has("dissipation") ? NotNegative(block, map, "dissipation") : 0.0;
  if (damps && map.Has("dissipation")) {
    yaml.Error(
        *map.node(), fmt::format("{} has both damping and dissipation", map.path()),
        "damping: c of c times the rate; dissipation: a of k depth^n (1 + a times the rate)");
    good = false;
  }
  if (!good || !stiffness || !exponent || !damping || !dissipation) return std::nullopt;
  stop.stiffness = *stiffness;
  stop.exponent = *exponent;
  stop.damping = *damping;
  stop.dissipation = *dissipation;
  return stop;
}

std::optional<StopLaw> ElementReader::ReadRigid(const Block& block, const YamlMap& map,
                                                StopLaw stop, bool good) {
  YamlReader& yaml = values_.yaml();
  for (const char* key : {"stiffness", "damping", "exponent", "dissipation"}) {
    if (map.FindInUnit(key, kSlopes).node == nullptr) continue;
    yaml.Error(*map.node(), fmt::format("{} has both restitution and {}", map.path(), key),
               "restitution: of a rigid stop, which exerts impulses; stiffness: of an elastic one");
    good = false;
  }
  const auto restitution = values_.Number(block, map, "restitution", {kPlain});
  if (!restitution) return std::nullopt;
  if (!(*restitution >= 0.0 && *restitution <= 1.0)) {
    yaml.Error(*map.Find("restitution"), fmt::format("{} = {} violates 0 <= restitution <= 1",
                                                     map.PathOf("restitution"), *restitution));
    return std::nullopt;
  }
  stop.restitution = *restitution;
  return good ? std::optional(stop) : std::nullopt;
}

namespace {

// Slopes of the monotone cubic through points [Fritsch, Butland 1984, as in PCHIP].
void MakeMonotone(std::vector<CurveLaw::Knot>* knots) {
  const size_t n = knots->size();
  std::vector<double> h, secant;
  for (size_t i = 1; i < n; ++i) {
    h.push_back((*knots)[i].at - (*knots)[i - 1].at);
    secant.push_back(((*knots)[i].force - (*knots)[i - 1].force) / h.back());
  }
  // Of the parabola through three points, as far as that keeps the sense of the first secant.
  const auto end = [](double h0, double h1, double d0, double d1) {
    const double slope = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
    if (slope * d0 <= 0.0) return 0.0;
    return d0 * d1 <= 0.0 && std::abs(slope) > 3.0 * std::abs(d0) ? 3.0 * d0 : slope;
  };
  for (size_t i = 0; i < n; ++i) {
    double slope = secant[0];
    if (n > 2 && i == 0) {
      slope = end(h[0], h[1], secant[0], secant[1]);
    } else if (n > 2 && i == n - 1) {
      slope = end(h[n - 2], h[n - 3], secant[n - 2], secant[n - 3]);
    } else if (n > 2) {
      const double d0 = secant[i - 1], d1 = secant[i];
      const double w0 = 2.0 * h[i] + h[i - 1], w1 = h[i] + 2.0 * h[i - 1];
      slope = d0 * d1 <= 0.0 ? 0.0 : (w0 + w1) / (w0 / d0 + w1 / d1);
    }
    (*knots)[i].slope_before = (*knots)[i].slope_after = slope;
  }
}

}  // namespace

std::optional<CurveLaw> ElementReader::ReadCurve(const Block& block, const YamlMap& map,
                                                 const ForceElement* element) {
  YamlReader& yaml = values_.yaml();
  CurveLaw curve;
  bool good = true;
  for (const char* key : {"rates", "rates_rpm", "beyond_rates"}) {
    if (!map.Has(key)) continue;
    yaml.Error(*map.Find(key), fmt::format("{} belongs to of: both", map.PathOf(key)),
               "of: both, with a force for each rate in every point");
    good = false;
  }
  if (const YamlNode* of = map.Find("of")) {
    const auto what = yaml.Choice(*of, map.PathOf("of"), {"position", "rate", "both"});
    good = what.has_value();
    curve.of_rate = what == 1;
  }
  const auto found = map.FindInUnit("points", {kPlain, kDeg, kMm, kRpm});
  if (found.node == nullptr) {
    (void)map.Required("points");
    return std::nullopt;
  }
  const std::string path = map.PathOf(found.key);
  const bool fits =
      element == nullptr ||
      (found.unit.suffix == kRpm.suffix ? curve.of_rate && !IsAlongLength(*element)
                                        : found.unit.Suits(IsAlongLength(*element) ? "m" : "rad"));
  if (!fits) {
    yaml.Error(*found.node, fmt::format("{}: the {} of '{}' is not in that unit", path,
                                        curve.of_rate ? "rate" : "coordinate", NameOf(*element)));
    good = false;
  }
  const auto points = values_.Points(block, *found.node, path, found.unit);
  if (!points) return std::nullopt;
  for (const auto& [at, force] : *points) curve.knots.push_back({.at = at, .force = force});
  if (!ReadSlopes(block, map, &curve) || !good) return std::nullopt;
  return curve;
}

// As stated, or by the interpolation, and what lies beyond the points.
bool ElementReader::ReadSlopes(const Block& block, const YamlMap& map, CurveLaw* curve,
                               int of_curves) {
  YamlReader& yaml = values_.yaml();
  std::vector<CurveLaw::Knot>& knots = curve->knots;
  if (const YamlNode* all = map.Find("slopes")) {
    const YamlNode* node = all;
    if (of_curves >= 0) {  // a list for each rate
      const auto lists = yaml.Items(*all, map.PathOf("slopes"));
      if (!lists) return false;
      if (static_cast<size_t>(of_curves) >= lists->size()) {
        yaml.Error(*all, map.PathOf("slopes") + ": one list of pairs per rate");
        return false;
      }
      node = (*lists)[static_cast<size_t>(of_curves)];
    }
    const auto slopes = values_.Pairs(block, *node, map.PathOf("slopes"), kPlain);
    if (!slopes) return false;
    if (slopes->size() == knots.size() && !map.Has("interpolation") && !map.Has("beyond")) {
      for (size_t i = 0; i < knots.size(); ++i) {
        knots[i].slope_before = (*slopes)[i].first;
        knots[i].slope_after = (*slopes)[i].second;
      }
      return true;
    }
    yaml.Error(*node, fmt::format("{}: one pair [before, after] per point, without interpolation "
                                  "and beyond",
                                  map.PathOf("slopes")));
    return false;
  }
  const YamlNode *way = map.Find("interpolation"), *beyond = map.Required("beyond");
  const auto interpolation =
      way == nullptr ? std::optional<int>(0)
                     : yaml.Choice(*way, map.PathOf("interpolation"), {"monotone", "linear"});
  const auto outside = beyond == nullptr
                           ? std::optional<int>()
                           : yaml.Choice(*beyond, map.PathOf("beyond"), {"held", "linear"});
  if (!interpolation || !outside) return false;
  MakeMonotone(&knots);
  for (size_t i = 1; i < knots.size() && *interpolation == 1; ++i) {
    const double secant = (knots[i].force - knots[i - 1].force) / (knots[i].at - knots[i - 1].at);
    knots[i - 1].slope_after = knots[i].slope_before = secant;
  }
  const bool straight = *outside == 1;
  knots.front().slope_before = straight ? knots.front().slope_after : 0.0;
  knots.back().slope_after = straight ? knots.back().slope_before : 0.0;
  return true;
}

// Rows of a place and its force at each rate.
std::optional<CurvesLaw> ElementReader::ReadCurves(const Block& block, const YamlMap& map,
                                                   const ForceElement* element) {
  YamlReader& yaml = values_.yaml();
  const bool turns = element != nullptr && !IsAlongLength(*element);
  const auto rates = map.FindInUnit("rates", {kPlain, kRpm});
  const auto points = map.FindInUnit("points", {kPlain, kDeg, kMm});
  if (rates.node == nullptr) (void)map.Required("rates");
  if (points.node == nullptr) (void)map.Required("points");
  const YamlNode* beyond = map.Required("beyond_rates");
  const auto held = beyond == nullptr
                        ? std::optional<int>()
                        : yaml.Choice(*beyond, map.PathOf("beyond_rates"), {"linear", "held"});
  if (rates.node == nullptr || points.node == nullptr || !held) return std::nullopt;
  CurvesLaw law{.rates = {}, .curves = {}, .held = *held == 1};
  bool good = true;
  const auto refuse = [&](const YamlNode& node, const std::string& text, const char* hint = "") {
    yaml.Error(node, text, hint);
    good = false;
  };
  const auto suits = [&](const YamlMap::InUnit& found, bool fits, const char* what) {
    if (element == nullptr || fits) return;
    refuse(*found.node, fmt::format("{}: the {} of '{}' is not in that unit", map.PathOf(found.key),
                                    what, NameOf(*element)));
  };
  suits(rates, rates.unit.suffix != kRpm.suffix || turns, "rate");
  suits(points, points.unit.Suits(turns ? "rad" : "m"), "coordinate");
  const std::string rates_path = map.PathOf(rates.key), path = map.PathOf(points.key);
  const auto speeds = yaml.Items(*rates.node, rates_path);
  const auto rows = yaml.Items(*points.node, path);
  if (!speeds || !rows) return std::nullopt;
  for (size_t i = 0; i < speeds->size(); ++i) {
    const auto rate =
        values_.Number(block, *(*speeds)[i], fmt::format("{}[{}]", rates_path, i), rates.unit);
    if (!rate) return std::nullopt;
    if (!law.rates.empty() && *rate <= law.rates.back()) {
      refuse(*(*speeds)[i], fmt::format("{}[{}]: rates must increase", rates_path, i));
    }
    law.rates.push_back(*rate);
  }
  if (law.rates.size() < 2) {
    refuse(*rates.node, rates_path + " has fewer than two rates",
           "a curve that is the same at any rate has no `of`");
  }
  if (rows->size() < 2) refuse(*points.node, path + " has fewer than two points");
  law.curves.resize(law.rates.size());
  for (size_t k = 0; k < rows->size() && good; ++k) {
    const std::string row_path = fmt::format("{}[{}]", path, k);
    const auto row = yaml.Items(*(*rows)[k], row_path, static_cast<int>(law.rates.size()) + 1);
    if (!row) return std::nullopt;
    const auto at = values_.Number(block, *(*row)[0], row_path + "[0]", points.unit);
    if (!at) return std::nullopt;
    if (k > 0 && *at <= law.curves[0].knots.back().at) {
      refuse(*(*row)[0], row_path + ": the first numbers must increase");
    }
    for (size_t i = 0; i < law.rates.size(); ++i) {
      const auto force =
          values_.Number(block, *(*row)[i + 1], fmt::format("{}[{}]", row_path, i + 1));
      if (!force) return std::nullopt;
      law.curves[i].knots.push_back({.at = *at, .force = *force});
    }
  }
  if (!good) return std::nullopt;
  for (size_t i = 0; i < law.rates.size(); ++i) {
    if (!ReadSlopes(block, map, &law.curves[i], static_cast<int>(i))) return std::nullopt;
  }
  return law;
}

// Names of parameters are replaced by their values, so that the text means the same elsewhere.
std::optional<ExpressionLaw> ElementReader::ReadExpression(const Block& block, const YamlMap& map) {
  YamlReader& yaml = values_.yaml();
  const YamlNode* node = map.Required("force");
  if (node == nullptr) return std::nullopt;
  const std::string path = map.PathOf("force");
  const auto text = yaml.Text(*node, path);
  if (!text) return std::nullopt;
  for (const char* name : {"x", "v"}) {
    const std::vector<std::string> parameters = block.scope->Names();
    if (std::ranges::find(parameters, name) == parameters.end()) continue;
    yaml.Error(*node,
               fmt::format("{}: {} is the {} here, and a parameter of the model", path, name,
                           *name == 'x' ? "coordinate" : "rate"),
               "give the parameter another name");
    return std::nullopt;
  }
  const FormulaResult compiled = block.scope->Compile(*text, {"x", "v"});
  if (compiled.formula == nullptr) {
    yaml.Error(*node, fmt::format("{} = '{}' {}", path, *text, compiled.error), compiled.hint);
    return std::nullopt;
  }
  const auto is_word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
  };
  ExpressionLaw law{.text = {}, .force = [formula = compiled.formula](double x, double v) {
                      return formula->At(std::array{x, v});
                    }};
  if (compiled.formula->has_branches()) {
    law.branch = [formula = compiled.formula](double x, double v) {
      return formula->BranchAt(std::array{x, v});
    };
    law.on_branch = [formula = compiled.formula](int branch, double x, double v) {
      return formula->OnBranch(branch, std::array{x, v});
    };
  }
  for (size_t i = 0; i < text->size();) {
    size_t end = i;
    while (end < text->size() && is_word((*text)[end])) ++end;
    if (end == i) ++end;
    const std::string piece = text->substr(i, end - i);
    const std::vector<std::string> parameters = block.scope->Names();
    const bool known = std::ranges::find(parameters, piece) != parameters.end();
    const auto value = known ? block.scope->Lookup(piece).value : std::nullopt;
    law.text += value ? fmt::format("({})", *value) : piece;
    i = end;
  }
  return law;
}

std::optional<SpringLaw> ElementReader::ReadSpring(const Block& block, const YamlMap& map,
                                                   const ForceElement* element) {
  SpringLaw spring;
  const auto polynomial = ReadPolynomial(block, map, element);
  std::optional<double> free = 0.0;
  if (element != nullptr) {
    free = ReadInCoordinateUnit(&values_, block, map, "free", IsAlongLength(*element),
                                NameOf(*element));
  }
  std::optional<double> preload = 0.0;
  if (map.Has("preload")) preload = values_.Number(block, map, "preload", {kPlain});
  if (!polynomial || !free || !preload) return std::nullopt;
  return SpringLaw{.polynomial = *polynomial, .free = *free, .preload = *preload};
}

// k, k2, …
std::optional<std::vector<double>> ElementReader::ReadPolynomial(const Block& block,
                                                                 const YamlMap& map,
                                                                 const ForceElement* element) {
  YamlReader& yaml = values_.yaml();
  const bool linear = map.FindInUnit("stiffness", kSlopes).node != nullptr;
  if (linear == map.Has("polynomial")) {
    yaml.Error(*map.node(), fmt::format("{} needs either stiffness or polynomial", map.path()),
               "stiffness: force by deflection; polynomial: the coefficients of x, x², x³, x⁴");
    return std::nullopt;
  }
  if (linear) {
    const auto stiffness = Slope(block, map, "stiffness", element);
    if (!stiffness) return std::nullopt;
    return std::vector<double>{*stiffness};
  }
  return ReadCoefficients(&values_, block, map, "polynomial");
}

std::optional<RotorLaw> ElementReader::ReadRotor(const Block& block, const YamlMap& map,
                                                 const ForceElement* element) {
  const auto inertia = NotNegative(block, map, "inertia", {kPlain, kKgCm2});
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
  const bool geared = map.Has("coupling") || map.Has("efficiency") || map.Has("efficiency_back") ||
                      map.Has("coefficient_back");
  const bool loaded = geared || map.Has("coefficient");
  auto law = ReadDry(block, map, loaded);
  if (!ReadResists(map, loaded, law ? &*law : nullptr) || element == nullptr) return std::nullopt;
  if (geared) return ReadGearLoss(block, map, *element, &*law) ? law : std::nullopt;
  return ReadBearings(block, map, *element, &*law) ? law : std::nullopt;
}

// Of a gear or a screw, on one of the coordinates that it couples.
bool ElementReader::ReadGearLoss(const Block& block, const YamlMap& map,
                                 const ForceElement& element, FrictionLaw* law) {
  YamlReader& yaml = values_.yaml();
  const YamlNode* node = map.Required("coupling");
  if (node == nullptr) return false;
  for (const char* key : {"radius", "length", "length_mm", "thrust_radius"}) {
    if (!map.Has(key)) continue;
    yaml.Error(*map.Find(key), fmt::format("{} has no meaning with a coupling", map.PathOf(key)));
    return false;
  }
  law->coupling = FindNamed(couplings_, "coupling", block, *node, map.PathOf("coupling"), &yaml);
  if (law->coupling < 0) return false;
  const auto& terms = couplings_[static_cast<size_t>(law->coupling)].terms;
  if (std::ranges::none_of(terms, [&](const Coupling::Term& term) {
        return term.joint == element.joint && term.coordinate == element.coordinate;
      })) {
    yaml.Error(*node,
               fmt::format("{} = {} does not couple the coordinate of '{}'", map.PathOf("coupling"),
                           node->text, NameOf(element)),
               "joint: one of those that it couples");
    return false;
  }
  if (map.Has("efficiency") == map.Has("coefficient")) {
    yaml.Error(*map.node(), fmt::format("{} needs either efficiency or coefficient", map.path()),
               "efficiency: where this coordinate drives; coefficient: friction by the coupling's "
               "force, 1/efficiency − 1");
    return false;
  }
  const bool by_efficiency = map.Has("efficiency");
  const char* back = by_efficiency ? "efficiency_back" : "coefficient_back";
  if (const char* other = by_efficiency ? "coefficient_back" : "efficiency_back"; map.Has(other)) {
    yaml.Error(*map.Find(other), fmt::format("{} goes with {}", map.PathOf(other),
                                             by_efficiency ? "coefficient" : "efficiency"));
    return false;
  }
  const auto at_most_one = [&](const char* key, std::optional<double> value) {
    if (!value || *value <= 1.0) return value;
    yaml.Error(*map.Find(key),
               fmt::format("{} = {} violates {} <= 1", map.PathOf(key), *value, key));
    return std::optional<double>();
  };
  std::optional<double> drives, driven;
  if (by_efficiency) {
    drives = at_most_one("efficiency", values_.Positive(block, map, "efficiency", {kPlain}));
    if (drives) drives = 1.0 / *drives - 1.0;
  } else {
    drives = NotNegative(block, map, "coefficient");
  }
  driven = drives;
  if (map.Has(back)) {
    driven = NotNegative(block, map, back);
    if (by_efficiency) driven = at_most_one(back, driven);
    if (driven && by_efficiency) driven = 1.0 - *driven;
  }
  if (!drives || !driven) return false;
  law->coefficient = 0.5 * (*drives + *driven);
  law->skew = 0.5 * (*drives - *driven);
  return true;
}

// Freewheels resist one way, whatever they bear.
bool ElementReader::ReadResists(const YamlMap& map, bool loaded, FrictionLaw* law) {
  const YamlNode* node = map.Find("resists");
  if (node == nullptr) return law != nullptr;
  YamlReader& yaml = values_.yaml();
  if (loaded) {
    yaml.Error(*node, fmt::format("{} has no meaning with friction by load", map.PathOf("resists")),
               "a second element beside it may resist one way");
    return false;
  }
  const auto word = yaml.Choice(*node, map.PathOf("resists"), {"positive", "negative"});
  if (!word || law == nullptr) return false;
  law->resists = *word == 0 ? 1 : -1;
  return true;
}

// How the joint bears its load. Only of these joints it is said what does.
bool ElementReader::ReadBearings(const Block& block, const YamlMap& map,
                                 const ForceElement& element, FrictionLaw* law) {
  YamlReader& yaml = values_.yaml();
  const JointKind kind = element.joint < 0 ? JointKind::kFree : joints_.joints[element.joint].kind;
  const bool loaded = map.Has("coefficient"), ball = IsOfBall(kind, element.coordinate);
  const bool slides = !ball && IsLength(kind, element.coordinate);
  const bool known = kind == JointKind::kRevolute || kind == JointKind::kPrismatic ||
                     kind == JointKind::kCylindrical || kind == JointKind::kUniversal ||
                     kind == JointKind::kSpherical;
  if (loaded && !known) {
    yaml.Error(*map.Find("coefficient"),
               fmt::format("{}: friction by the joint's load is known of revolute, prismatic, "
                           "cylindrical, universal and spherical joints only",
                           map.PathOf("coefficient")),
               "coulomb: friction whatever the load");
    return false;
  }
  const bool thrusts = loaded && !slides && !ball && kind != JointKind::kCylindrical;
  const auto lacks = [&](const char* key, bool fits, const char* hint) {
    const auto found = map.FindInUnit(key, {kPlain, kMm});
    if (found.node == nullptr || fits) return false;
    yaml.Error(*found.node, fmt::format("{} has no meaning here", map.PathOf(found.key)), hint);
    return true;
  };
  const bool strange =
      lacks("radius", loaded && !slides,
            "radius: of the journal or ball of a joint whose friction is coefficient times radius "
            "times its load") |
      lacks("length", loaded && !ball,
            "length: between the two bearings of an axis, or of a guide") |
      lacks("thrust_radius", thrusts,
            "thrust_radius: of the collar that bears the force along the axis of a revolute or "
            "universal joint");
  if (strange) return false;
  if (!loaded) return true;
  const auto coefficient = NotNegative(block, map, "coefficient");
  const bool has_radius = map.FindInUnit("radius", {kPlain, kMm}).node != nullptr;
  const bool thrust = map.FindInUnit("thrust_radius", {kPlain, kMm}).node != nullptr;
  if (!slides && !has_radius && !thrust) {
    yaml.Error(*map.node(), fmt::format("{} needs a radius", map.path()),
               "radius: of the journal or ball of a joint whose friction is coefficient times "
               "radius times its load");
    return false;
  }
  const auto positive = [&](const char* key, bool stated, double otherwise) {
    return stated ? values_.Positive(block, map, key, {kPlain, kMm}) : std::optional(otherwise);
  };
  const auto radius = positive("radius", has_radius, slides ? 1.0 : 0.0);
  const auto thrust_radius = positive("thrust_radius", thrust, 0.0);
  const auto length = positive("length", map.FindInUnit("length", {kPlain, kMm}).node != nullptr,
                               std::numeric_limits<double>::infinity());
  if (!coefficient || !radius || !thrust_radius || !length) return false;
  law->coefficient = *coefficient;
  law->radius = *radius;
  law->thrust_radius = *thrust_radius;
  law->length = *length;
  return true;
}

std::optional<FrictionLaw> ElementReader::ReadDry(const Block& block, const YamlMap& map,
                                                  bool loaded) {
  YamlReader& yaml = values_.yaml();
  if (loaded && !map.Has("coulomb") && !map.Has("breakaway") && !map.Has("stribeck_rate")) {
    return FrictionLaw{};
  }
  const auto coulomb = NotNegative(block, map, "coulomb");
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

// Required.
std::optional<double> ElementReader::NotNegative(const Block& block, const YamlMap& map,
                                                 const std::string& key,
                                                 std::initializer_list<UnitSuffix> units) {
  const auto found = map.FindInUnit(key, units);
  if (found.node == nullptr) {
    (void)map.Required(key);
    return std::nullopt;
  }
  const std::string path = map.PathOf(found.key);
  const auto value = values_.Number(block, *found.node, path, found.unit);
  if (!value || *value >= 0.0) return value;
  values_.yaml().Error(*found.node, fmt::format("{} = {} violates {} >= 0", path, *value, key));
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
  const Joint* joint = element.joint >= 0 ? &joints_.joints[element.joint] : nullptr;
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
