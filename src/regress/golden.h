// Golden traces: each witness' drive forces as kept in the history, to see which witness moved.
//
// Values keep 36 bits of mantissa (1.5e-11 relative): far finer than a movement that is reported,
// coarse enough that roundoff rarely changes the bytes, so equal nights share one copy.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/types.h"

namespace mbv {

/// Drive forces of one witness.
struct ForceTrace {
  std::vector<std::string> drives;  ///< m names
  MatX force;                       ///< n samples × m [N or N m]; NaN where missing
};
/// By witness (core/roles.h).
using GoldenTraces = std::map<std::string, ForceTrace>;

/// Columns DRIVE.force.WITNESS of a traces.csv; the largest sizes are thinned to at most
/// `max_samples` evenly spaced rows. Empty when the text has no such columns.
[[nodiscard]] GoldenTraces ReadForces(const std::string& csv, size_t max_samples = 2001);

/// Compressed bytes (deflate), and back; empty for bytes that Encode() did not write.
[[nodiscard]] std::string Encode(const ForceTrace& trace);
[[nodiscard]] std::optional<ForceTrace> DecodeForces(const std::string& bytes);

/// Relative RMS change above which a witness has moved; above what a compiler or processor changes.
inline constexpr double kMoved = 1e-9;

/// How far one witness' forces are from an earlier run's.
struct Movement {
  double relative = 0.0;  ///< RMS change / RMS before, over all drives; infinite for another shape
  std::string worst;      ///< drive that changed most
  [[nodiscard]] bool moved() const { return !(relative <= kMoved); }
};
[[nodiscard]] Movement Compare(const ForceTrace& before, const ForceTrace& now);

/// "both moved (analytic by 3.2e-03, simulation by 3.2e-03; most drive limb2.drive)", "analytic
/// moved …", "simulation moved …", "reference moved …"; "" if none moved. Witnesses that only one
/// side has are left out.
[[nodiscard]] std::string AttributeMovement(const GoldenTraces& before, const GoldenTraces& now);

}  // namespace mbv
