// Units of table columns: what MATLAB, ADAMS, Simscape and Excel users write, in SI.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace mbv {

/// A unit of a column.
struct TableUnit {
  std::string text;     ///< as written, without brackets: "kN"
  std::string si;       ///< the SI unit of its kind, spelled as in channels: "N", "N m", "rad/s"
  double factor = 1.0;  ///< SI value = factor · value
};

/// The unit written in `text`: "kN", "(newton)", "[N*mm]", "mm/s^2", "deg/sec**2", "rpm"; products
/// by `*`, `·`, `-`, `.` or a space, quotients by `/`. Empty when it is not a unit that is known.
[[nodiscard]] std::optional<TableUnit> FindUnit(std::string_view text);

/// "did you mean 'kN'?" for a misspelt unit, else the list of units of the kind `si` ("" for all).
[[nodiscard]] std::string UnitHint(const std::string& text, const std::string& si = "");

/// `text` without blanks at its ends and without one pair of brackets around it.
[[nodiscard]] std::string_view StripUnit(std::string_view text);

}  // namespace mbv
