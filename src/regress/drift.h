// Drift: a metric that is within its limit but much worse than it used to be.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/types.h"

namespace mbv {

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
