#include "pipeline/bendable.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "input/units.h"

namespace mbv {
namespace {

// Its value; the largest one of its unit if that is zero.
double ScaleOf(const Parameter& parameter, const std::vector<Parameter>& all) {
  if (parameter.value != 0.0) return parameter.value;
  double largest = 0.0;
  for (const Parameter& other : all) {
    if (other.unit == parameter.unit) largest = std::max(largest, std::abs(other.value));
  }
  return largest > 0.0 ? largest : 1.0;
}

// The keys of a place, without indices: "parts", "leg", "bodies", "rod", "inertia".
std::vector<std::string> KeysOf(const std::string& place) {
  std::vector<std::string> keys(1);
  for (const char c : place) {
    if (c == '[') keys.back() += '\0';  // the rest of the key is an index
    if (c == '.') {
      keys.emplace_back();
    } else {
      keys.back() += c;
    }
  }
  for (std::string& key : keys) key = key.substr(0, key.find('\0'));
  return keys;
}

// A key of this word, whatever unit it is written in.
bool Has(const std::vector<std::string>& keys, const std::string& word) {
  return std::any_of(keys.begin(), keys.end(),
                     [&](const std::string& key) { return SplitUnit(key).name == word; });
}

bool CanAct(const Literal& literal) {
  const std::vector<std::string> keys = KeysOf(literal.place);
  static constexpr std::array kNoForce = {"shapes", "range",    "guess",     "up",       "radius",
                                          "beams",  "sections", "materials", "instances"};
  if (std::any_of(kNoForce.begin(), kNoForce.end(),
                  [&](const char* key) { return Has(keys, key); })) {
    return false;
  }
  if (Has(keys, "drives") && Has(keys, "stiffness")) return false;  // of a servo
  const bool axis = Has(keys, "axis") || Has(keys, "axis2") || Has(keys, "axes");
  return literal.value != 0.0 && !(axis && std::abs(literal.value) == 1.0);
}

// Of a bushing's list; the index of its number is the last character but one of its place.
std::string BushingUnit(const std::string& place, bool damping) {
  const char index = place.size() < 2 ? '0' : place[place.size() - 2];
  const bool length = index < '3';
  if (damping) return length ? "N s/m" : "N m s/rad";
  return length ? "N/m" : "N m/rad";
}

// Of a force element; `keys` end in what it is, behind the element's name.
std::string ElementUnit(const Mechanism& mechanism, const std::vector<std::string>& keys) {
  if (Has(keys, "inertia")) return "kg m^2";
  if (Has(keys, "radius")) return "m";
  for (const ForceElement& element : mechanism.elements) {
    const std::string name = element.name.substr(element.name.rfind('.') + 1);
    if (keys.size() < 2 || keys[keys.size() - 2] != name) continue;
    const bool length = ActsOnLength(mechanism, element);
    if (Has(keys, "damping")) return length ? "N s/m" : "N m s/rad";
    if (Has(keys, "stiffness")) return length ? "N/m" : "N m/rad";
    if (Has(keys, "stribeck_rate")) return length ? "m/s" : "rad/s";
    if (Has(keys, "preload") || Has(keys, "coulomb") || Has(keys, "breakaway"))
      return length ? "N" : "N m";
    if (Has(keys, "free")) return length ? "m" : "rad";
  }
  return "";
}

std::string UnitOf(const Mechanism& mechanism, const Literal& literal) {
  const std::vector<std::string> keys = KeysOf(literal.place);
  const bool damping = Has(keys, "damping");
  if (Has(keys, "elements") && literal.place.ends_with("]") &&
      (damping || Has(keys, "stiffness"))) {
    return BushingUnit(literal.place, damping);
  }
  if (Has(keys, "elements")) return ElementUnit(mechanism, keys);
  if (Has(keys, "inertia")) return "kg m^2";
  if (Has(keys, "mass")) return "kg";
  if (Has(keys, "gravity")) return "m/s^2";
  if (Has(keys, "rpy") || Has(keys, "angle")) return "rad";
  if (Has(keys, "com") || Has(keys, "position") || Has(keys, "frames") || Has(keys, "attach") ||
      Has(keys, "origin") || Has(keys, "from") || Has(keys, "to") || Has(keys, "free_length")) {
    return "m";
  }
  if (Has(keys, "stiffness")) return "N/m";
  return Has(keys, "damping") ? "N s/m" : "";
}

}  // namespace

std::string Bendable::Text(double error) const {
  const std::string percent = fmt::format("{:.3g} %", 100.0 * std::abs(error));
  if (value != 0.0) return percent + (error > 0.0 ? " too large" : " too small");
  return fmt::format("{} of {:g}{}{} instead of 0", percent,
                     error > 0.0 ? relative_to : -relative_to, unit.empty() ? "" : " ", unit);
}

std::vector<Bendable> BendablesOf(const Mechanism& mechanism,
                                  const std::vector<Literal>& literals) {
  std::vector<Bendable> all;
  const std::vector<Parameter>& parameters = mechanism.parameters;
  for (const bool instance : {false, true}) {
    for (const Parameter& p : parameters) {
      if ((p.name.find('.') != std::string::npos) != instance) continue;
      all.push_back({p.name, p.unit, instance ? NumberKind::kInstance : NumberKind::kParameter,
                     p.value, ScaleOf(p, parameters)});
    }
  }
  for (const Literal& literal : literals) {
    if (!CanAct(literal)) continue;
    all.push_back({literal.place, UnitOf(mechanism, literal), NumberKind::kLiteral, literal.value,
                   literal.value});
  }
  return all;
}

}  // namespace mbv
