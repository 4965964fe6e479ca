// What many values of one quantity say: percentiles, histograms, shares with their uncertainty.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/types.h"

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

// Sobol' indices: which share of a quantity's variance each varied number makes, alone and with all
// others.

struct SobolIndex {
  double first = kNan;  ///< share of the variance that goes when this number alone is known
  double total = kNan;  ///< share that is left when all others are known
  Interval first_interval, total_interval;  ///< 95 %, bootstrap of blocks
};

struct SobolResult {
  std::vector<SobolIndex> indices;  ///< per number
  double mean = kNan, variance = kNan;
  size_t blocks = 0, left_out = 0;  ///< used; without a value at some of their points
};

/// `values`: blocks × (numbers + 2), as DesignKind::kSaltelli orders them. First order by
/// [Saltelli 2010, Comput. Phys. Commun. 181, Table 2 (b)], total by [Jansen 1999, ibid. (f)], of
/// values less their mean. A constant quantity has no indices (NaN).
[[nodiscard]] SobolResult SobolIndices(std::span<const double> values, size_t numbers);

}  // namespace mbv
