// Factors by which signals of other programs are wrong: units, mostly.
#pragma once

namespace mbv {

struct KnownFactor {
  double factor;
  const char* text;  ///< "1000: is the unit kN, mm or ms mistaken?"
};

/// How far a fitted factor may be from a known one.
inline constexpr double kSameFactor = 5e-3;

/// The known one that a fitted factor > 0 is; null if it is none.
[[nodiscard]] const KnownFactor* FindFactor(double factor);

}  // namespace mbv
