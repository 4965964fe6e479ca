// Drive strokes and joint ranges along a motion.
#pragma once

#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/run_summary.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// A coordinate that leaves its range, at its worst sample.
struct RangeViolation {
  std::string what;  ///< "drive limb1.drive" or "joint limb1.U1, coordinate 0"
  double time_s = kNan;
  double value = kNan;
  CoordinateRange range;
  double amount = 0.0;  ///< by how much [unit]
  std::string unit;

  /// "at t = 0.43 s drive leg2 needs 0.913 m, its range is 0.5 … 0.75 m (0.163 m beyond)"
  [[nodiscard]] std::string Text() const;
};

/// Drives that leave their range in a trace's position channels, in model order.
[[nodiscard]] std::vector<RangeViolation> DriveViolations(const Mechanism& mechanism,
                                                          const Trace& trace);

/// Joint coordinates that leave their range at given body poses per sample.
[[nodiscard]] std::vector<RangeViolation> JointViolations(
    const Mechanism& mechanism, const std::vector<double>& time_s,
    const std::vector<std::vector<Pose>>& X_WB);

/// Any joint coordinate or drive is bounded.
[[nodiscard]] bool HasRanges(const Mechanism& mechanism);

/// No joint coordinate and no drive is beyond its range at these body poses. Workspaces and
/// stiffness maps count a pose as reached under this condition.
[[nodiscard]] bool IsWithinRanges(const Mechanism& mechanism, const std::vector<Pose>& X_WB);

/// The summary of a witness that must not run (or not count) because of violations.
[[nodiscard]] RunSummary LimitSummary(const std::vector<RangeViolation>& violations);

/// One "stroke violation" finding each, placed in the scenario file.
void AddFindings(const std::vector<RangeViolation>& violations, const std::string& file,
                 Severity severity, Diagnostics* findings);

}  // namespace mbv
