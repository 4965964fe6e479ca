// How small a force is that a mechanism does not notice.
#pragma once

#include "comparison/comparison.h"

namespace mbv {

/// The largest force that a run has anyway: the heaviest body's weight, the largest load, the
/// heaviest body at the drives' RMS acceleration (angles at the characteristic length), the largest
/// spring force; at least the heaviest body's mass at 1 m/s² [N].
struct ForceScale {
  double force_N = 0.0;
  double length_m = 1.0;  ///< characteristic length of the mechanism: arm of the moments

  /// Relative errors of forces below 0.1 % of the scale are taken from there [N or N m]: forces
  /// that cancel out leave round-off of this size, and its relative error says nothing.
  [[nodiscard]] double Floor(const std::string& unit) const {
    return kIdle * force_N * (unit == "N m" ? length_m : 1.0);
  }
  static constexpr double kIdle = 1e-3;
};
[[nodiscard]] ForceScale ForceScaleOf(const ComparisonInput& input, const Trace& trace);

}  // namespace mbv
