// Sobol' indices: which share of a quantity's variance each varied number makes, alone and with all
// others.
#pragma once

#include <span>
#include <vector>

#include "study/statistics.h"

namespace mbv {

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
