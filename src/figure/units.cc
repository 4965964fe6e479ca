#include "figure/units.h"

#include <cmath>
#include <numbers>

namespace mbv {
namespace {

constexpr double kToDegrees = 180.0 / std::numbers::pi;
constexpr double kFewest = 1e-2, kMost = 1e4;  // largest values that are short as they are

// The first of each is SI; the last column tells whether it is chosen by itself.
struct UnitRow {
  ShownUnit unit;
  bool usual = true;
};
const std::vector<UnitRow>& UnitRows() {
  static const std::vector<UnitRow> rows = {
      {{"s", "s", "s", 1}},
      {{"s", "ms", "ms", 1e3}},
      {{"m", "m", "m", 1}},
      {{"m", "mm", "mm", 1e3}},
      {{"m", "um", "µm", 1e6}, false},
      {{"rad", "rad", "rad", 1}, false},
      {{"rad", "deg", "°", kToDegrees}},
      {{"rad", "mrad", "mrad", 1e3}, false},
      {{"m/s", "m/s", "m/s", 1}},
      {{"m/s", "mm/s", "mm/s", 1e3}},
      {{"rad/s", "rad/s", "rad/s", 1}},
      {{"rad/s", "deg/s", "°/s", kToDegrees}, false},
      {{"rad/s", "rpm", "1/min", 30 / std::numbers::pi}, false},
      {{"m/s^2", "m/s^2", "m/s^{2}", 1}},
      {{"rad/s^2", "rad/s^2", "rad/s^{2}", 1}},
      {{"rad/s^2", "deg/s^2", "°/s^{2}", kToDegrees}, false},
      {{"N", "N", "N", 1}},
      {{"N", "kN", "kN", 1e-3}},
      {{"N", "mN", "mN", 1e3}},
      {{"N m", "N m", "N·m", 1}},
      {{"N m", "kN m", "kN·m", 1e-3}},
      {{"N m", "mN m", "mN·m", 1e3}},
      {{"N m", "N mm", "N·mm", 1e3}, false},
      {{"W", "W", "W", 1}},
      {{"W", "kW", "kW", 1e-3}},
      {{"W", "mW", "mW", 1e3}},
      {{"J", "J", "J", 1}},
      {{"J", "kJ", "kJ", 1e-3}},
      {{"J", "mJ", "mJ", 1e3}},
  };
  return rows;
}

}  // namespace

const ShownUnit* FindUnit(const std::string& si, const std::string& name) {
  for (const UnitRow& row : UnitRows()) {
    if (row.unit.si == si && row.unit.name == name) return &row.unit;
  }
  return nullptr;
}

std::vector<std::string> UnitsOf(const std::string& si) {
  std::vector<std::string> names;
  for (const UnitRow& row : UnitRows()) {
    if (row.unit.si == si) names.push_back(row.unit.name);
  }
  if (names.empty()) names.push_back(si);
  return names;
}

ShownUnit UsualUnit(const std::string& si, double largest) {
  const ShownUnit* usual = nullptr;
  for (const UnitRow& row : UnitRows()) {
    if (row.unit.si != si || !row.usual) continue;
    const double shown = largest * row.unit.factor;
    if (usual == nullptr ||
        (shown >= kFewest && shown < kMost &&
         !(largest * usual->factor >= kFewest && largest * usual->factor < kMost))) {
      usual = &row.unit;
    }
  }
  return usual != nullptr ? *usual : ShownUnit{si, si, si == "1" ? "" : si, 1.0};
}

}  // namespace mbv
