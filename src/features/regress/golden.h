// Golden traces: each witness' drive forces as kept in the history, to see which witness moved.
//
// Values keep 36 bits of mantissa (1.5e-11 relative): far finer than a movement that is reported,
// coarse enough that roundoff rarely changes the bytes, so equal runs share one copy.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/types.h"

namespace mbv {

/// Drive forces of one witness.
struct ForceTrace {
  std::vector<std::string> drives;  ///< m names
  MatX force;                       ///< n samples × m [N or N m]; NaN where missing
};
/// By witness (base/roles.h).
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

// Drift: a metric that is within its limit but much worse than it used to be.

/// One earlier run's value of a metric.
struct PastValue {
  long run = 0;
  double value = kNan;
  bool good = false;     ///< the scenario was as expected and the check passed
  bool drifted = false;  ///< was reported as drift then: never part of a baseline
};

/// What counts as drift. Values are compared on a logarithmic scale.
struct DriftRule {
  double factor = 10.0;        ///< at least this many times worse than the median
  double spread_factor = 6.0;  ///< and this many robust standard deviations (from the MAD) above
  double noise_floor = 1e-13;  ///< smaller values count as this: roundoff (ratios, m, rad)
  size_t window = 20;          ///< last good runs that form the baseline
  size_t min_runs = 3;         ///< fewer good runs give no baseline
};

/// A metric's verdict against its own history.
struct DriftFinding {
  double baseline = kNan;   ///< median of the last good runs
  double threshold = kNan;  ///< what would just not be drift
  size_t good_runs = 0;     ///< in the baseline
  long since_run = 0;       ///< first run of the unbroken drift; 0: now
};

/// Judges `now` by the runs before (oldest first); empty: no drift, or no baseline.
[[nodiscard]] std::optional<DriftFinding> FindDrift(const std::vector<PastValue>& past, double now,
                                                    const DriftRule& rule = {});

}  // namespace mbv
