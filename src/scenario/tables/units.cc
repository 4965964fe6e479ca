#include "scenario/tables/text.h"

#include <fmt/format.h>

#include <array>
#include <cctype>
#include <numbers>
#include <vector>

#include "base/text.h"

namespace mbv {
namespace {

// Powers of length, time, angle and force.
using Dimension = std::array<int, 4>;
constexpr Dimension kLength{1, 0, 0, 0}, kDuration{0, 1, 0, 0}, kAngle{0, 0, 1, 0},
    kForce{0, 0, 0, 1};

struct BaseUnit {
  const char* name;
  Dimension dimension;
  double factor;
};

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kPound_N = 4.4482216152605;
constexpr double kStandardGravity = 9.80665;

// Spelled as usual; other capitals are accepted where no two units differ only in them.
constexpr BaseUnit kUnits[] = {
    {"m", kLength, 1.0},
    {"mm", kLength, 1e-3},
    {"cm", kLength, 1e-2},
    {"um", kLength, 1e-6},
    {"µm", kLength, 1e-6},
    {"km", kLength, 1e3},
    {"in", kLength, 0.0254},
    {"inch", kLength, 0.0254},
    {"ft", kLength, 0.3048},
    {"foot", kLength, 0.3048},
    {"meter", kLength, 1.0},
    {"metre", kLength, 1.0},
    {"millimeter", kLength, 1e-3},
    {"millimetre", kLength, 1e-3},
    {"centimeter", kLength, 1e-2},
    {"centimetre", kLength, 1e-2},
    {"s", kDuration, 1.0},
    {"sec", kDuration, 1.0},
    {"second", kDuration, 1.0},
    {"ms", kDuration, 1e-3},
    {"msec", kDuration, 1e-3},
    {"millisecond", kDuration, 1e-3},
    {"us", kDuration, 1e-6},
    {"µs", kDuration, 1e-6},
    {"min", kDuration, 60.0},
    {"minute", kDuration, 60.0},
    {"h", kDuration, 3600.0},
    {"hour", kDuration, 3600.0},
    {"rad", kAngle, 1.0},
    {"radian", kAngle, 1.0},
    {"mrad", kAngle, 1e-3},
    {"deg", kAngle, kDegree},
    {"degree", kAngle, kDegree},
    {"°", kAngle, kDegree},
    {"rev", kAngle, kTurn},
    {"turn", kAngle, kTurn},
    {"N", kForce, 1.0},
    {"newton", kForce, 1.0},
    {"kN", kForce, 1e3},
    {"kilonewton", kForce, 1e3},
    {"mN", kForce, 1e-3},
    {"MN", kForce, 1e6},
    {"daN", kForce, 10.0},
    {"kgf", kForce, kStandardGravity},
    {"kilogram_force", kForce, kStandardGravity},
    {"lbf", kForce, kPound_N},
    {"pound_force", kForce, kPound_N},
    {"dyne", kForce, 1e-5},
    {"Nm", {1, 0, 0, 1}, 1.0},
    {"Nmm", {1, 0, 0, 1}, 1e-3},
    {"kNm", {1, 0, 0, 1}, 1e3},
    {"mNm", {1, 0, 0, 1}, 1e-3},
    {"rpm", {0, -1, 1, 0}, kTurn / 60.0},
    {"g", {1, -2, 0, 0}, kStandardGravity},
    {"gee", {1, -2, 0, 0}, kStandardGravity},
};

struct Kind {
  const char* si;
  Dimension dimension;
  const char* common;  // for hints
};
constexpr Kind kKinds[] = {
    {"s", kDuration, "s, ms, min"},
    {"m", kLength, "m, mm, cm, in"},
    {"rad", kAngle, "rad, deg, rev"},
    {"m/s", {1, -1, 0, 0}, "m/s, mm/s"},
    {"rad/s", {0, -1, 1, 0}, "rad/s, deg/s, rpm"},
    {"m/s^2", {1, -2, 0, 0}, "m/s^2, mm/s^2, g"},
    {"rad/s^2", {0, -2, 1, 0}, "rad/s^2, deg/s^2"},
    {"N", kForce, "N, kN, mN, kgf, lbf"},
    {"N m", {1, 0, 0, 1}, "N*m, N*mm, kN*m"},
};

std::string Lower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

// By exact spelling; else by lower case, if that is not ambiguous; else as a plural.
const BaseUnit* FindBase(std::string_view word) {
  for (const BaseUnit& unit : kUnits) {
    if (word == unit.name) return &unit;
  }
  const std::string lower = Lower(word);
  const BaseUnit* found = nullptr;
  for (const BaseUnit& unit : kUnits) {
    if (lower != Lower(unit.name)) continue;
    if (found != nullptr) return nullptr;  // mN and MN
    found = &unit;
  }
  if (found == nullptr && lower.size() > 3 && lower.back() == 's') {
    return FindBase(std::string_view(lower).substr(0, lower.size() - 1));
  }
  return found;
}

void ReplaceAll(std::string* text, std::string_view from, std::string_view to) {
  for (size_t at = 0; (at = text->find(from, at)) != std::string::npos; at += to.size()) {
    text->replace(at, from.size(), to);
  }
}

// One factor: a unit with an optional exponent ("s^2", "s2", "sec").
bool Multiply(std::string_view word, int sign, Dimension* dimension, double* factor) {
  int exponent = 1;
  if (word.size() > 1 && (word.back() == '2' || word.back() == '3')) {
    exponent = word.back() - '0';
    word.remove_suffix(word[word.size() - 2] == '^' ? 2 : 1);
  }
  const BaseUnit* unit = FindBase(word);
  if (unit == nullptr) return false;
  for (int k = 0; k < exponent; ++k) {
    for (size_t d = 0; d < dimension->size(); ++d) (*dimension)[d] += sign * unit->dimension[d];
    *factor = sign > 0 ? *factor * unit->factor : *factor / unit->factor;
  }
  return true;
}

constexpr size_t kLongest = 40;  // characters of a unit

}  // namespace

std::string_view StripUnit(std::string_view text) {
  const auto trim = [&text] {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) {
      text.remove_prefix(1);
    }
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) {
      text.remove_suffix(1);
    }
  };
  trim();
  if (text.size() >= 2 &&
      ((text.front() == '(' && text.back() == ')') || (text.front() == '[' && text.back() == ']') ||
       (text.front() == '{' && text.back() == '}'))) {
    text = text.substr(1, text.size() - 2);
    trim();
  }
  return text;
}

std::optional<TableUnit> FindUnit(std::string_view text) {
  text = StripUnit(text);
  if (text.empty() || text.size() > kLongest) return {};
  TableUnit unit{.text = std::string(text), .si = {}, .factor = 1.0};
  std::string plain(text);
  for (const auto& [from, to] :
       {std::pair{"**", "^"}, {"²", "^2"}, {"·", "*"}, {"μ", "µ"}, {"(", ""}, {")", ""}}) {
    ReplaceAll(&plain, from, to);
  }
  Dimension dimension{};
  int sign = 1;
  for (size_t start = 0; start <= plain.size();) {
    const size_t end = std::min(plain.find_first_of("*/ -.", start), plain.size());
    if (end > start && !Multiply(std::string_view(plain).substr(start, end - start), sign,
                                 &dimension, &unit.factor)) {
      return {};
    }
    if (end < plain.size() && plain[end] == '/') sign = -1;
    start = end + 1;
  }
  for (const Kind& kind : kKinds) {
    if (kind.dimension == dimension) unit.si = kind.si;
  }
  if (unit.si.empty()) return {};
  return unit;
}

std::string UnitHint(const std::string& text, const std::string& si) {
  std::vector<std::string> names;
  for (const BaseUnit& unit : kUnits) names.emplace_back(unit.name);
  for (const char* name : {"N*m", "N*mm", "kN*m", "m/s", "mm/s", "m/s^2", "mm/s^2", "deg/s",
                           "deg/s^2", "rad/s", "rad/s^2"}) {
    names.emplace_back(name);
  }
  std::string known;
  for (const Kind& kind : kKinds) {
    if (si.empty() || si == kind.si)
      known += (known.empty() ? "" : ", ") + std::string(kind.common);
  }
  return DidYouMean(text, names, "known units: " + known);
}

}  // namespace mbv
