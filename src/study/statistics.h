// What many values of one quantity say: percentiles, histograms, shares with their uncertainty.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace mbv {

struct Interval {
  double lower = kNan, upper = kNan;
};

/// The value below which a share (0 … 1) of increasing values lies, linear between them; NaN of
/// none.
[[nodiscard]] double Percentile(std::span<const double> sorted, double share);

/// The exact interval of a probability of which `hits` of `count` independent trials gave evidence
/// [Clopper, Pearson 1934]: at most (1 − confidence)/2 beyond each end. NaN without trials.
[[nodiscard]] Interval ClopperPearson(std::uint64_t hits, std::uint64_t count,
                                      double confidence = 0.95);

struct Histogram {
  double from = kNan, to = kNan;
  std::vector<std::uint64_t> counts;  ///< of equal bins; the last one has both its ends
};
/// Bins by Freedman and Diaconis' rule, 5 … 60 of them; one where all values are the same.
[[nodiscard]] Histogram HistogramOf(std::span<const double> sorted);

}  // namespace mbv
