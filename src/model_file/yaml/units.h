// Units at the end of a name: `guess_deg`, `value_mm`, `--set length_mm=9`.
#pragma once

#include <functional>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace mbv {

/// Angle [rad] of a number of degrees, rounded once for the `pi` that expressions know: 30° is pi/6
/// to the last bit.
[[nodiscard]] double FromDegrees(double value);
/// Length [m] of a number of millimetres: the decimal that was typed (up to 15 digits), its point
/// moved by three places, so that 9 mm and 4.1 mm are the numbers 0.009 and 0.0041. Neither 9 *
/// 1e-3 nor 4.1 / 1000 is.
[[nodiscard]] double FromMillimetres(double value);

/// The unit that the end of a name states.
struct UnitSuffix {
  std::string_view suffix;        ///< "_deg"; "" where the name states no unit
  std::string_view si;            ///< of the number that it becomes: "rad"; "" for any
  double (*to_si)(double value);  ///< in that unit

  /// Whether it can state a number of `unit` ("m", "rad", …).
  [[nodiscard]] bool Suits(std::string_view unit) const { return si.empty() || si == unit; }
};
inline constexpr UnitSuffix kPlain{"", "", [](double value) { return value; }};
inline constexpr UnitSuffix kDeg{"_deg", "rad", FromDegrees};
inline constexpr UnitSuffix kMm{"_mm", "m", FromMillimetres};
inline constexpr UnitSuffix kRpm{"_rpm", "rad/s",
                                 [](double value) { return value * std::numbers::pi / 30.0; }};
/// Units of data sheets: N/mm and N s/mm, N m/° and N m s/°, and others.
inline constexpr UnitSuffix kPerMm{"_per_mm", "m", [](double value) { return value * 1e3; }};
inline constexpr UnitSuffix kPerDeg{"_per_deg", "rad",
                                    [](double value) { return value / FromDegrees(1.0); }};
inline constexpr UnitSuffix kKgCm2{"_kg_cm2", "kg m²", [](double value) { return value / 1e4; }};
inline constexpr UnitSuffix kNcm{"_N_cm", "N m", [](double value) { return value / 100.0; }};
inline constexpr UnitSuffix kMnm{"_mN_m", "N m", [](double value) { return value / 1000.0; }};

/// A name, and the unit that its end states.
struct NameInUnit {
  std::string name;
  UnitSuffix unit = kPlain;
};
/// "l" in millimetres from "l_mm".
[[nodiscard]] NameInUnit SplitUnit(const std::string& given);
/// The same where a known name may end as a unit does: the whole name if it is known, or if the one
/// without unit is not.
[[nodiscard]] NameInUnit SplitUnit(const std::string& given,
                                   const std::function<bool(const std::string&)>& is_known);

/// The key as it stands in files: "x", "x_deg", "x_mm".
[[nodiscard]] std::vector<std::string> InEveryUnit(const std::string& key);

}  // namespace mbv
