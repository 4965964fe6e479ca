// Units in which figures show what channels record in SI.
#pragma once

#include <string>
#include <vector>

namespace mbv {

struct ShownUnit {
  std::string si;       ///< as channels name it: "N m"
  std::string name;     ///< as files name it: "kN m"
  std::string shown;    ///< in a label: "kN·m"
  double factor = 1.0;  ///< shown = factor · SI
};

/// The unit `name` of what is recorded in `si`; null if it is none of it.
[[nodiscard]] const ShownUnit* FindUnit(const std::string& si, const std::string& name);
/// The names of all units of what is recorded in `si`; at least itself.
[[nodiscard]] std::vector<std::string> UnitsOf(const std::string& si);
/// The one in which values up to `largest` (SI) are short; degrees for angles.
[[nodiscard]] ShownUnit UsualUnit(const std::string& si, double largest);

}  // namespace mbv
