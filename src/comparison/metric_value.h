// Single numbers out of a comparison.
#pragma once

#include <map>
#include <string>

#include "comparison/comparison.h"

namespace mbv {

/// NaN where it was not measured.
[[nodiscard]] inline double ValueOf(const std::map<Metric, Measured>& metrics, Metric metric) {
  const auto found = metrics.find(metric);
  return found == metrics.end() ? kNan : found->second.value;
}

/// Whichever of the two is held against the other; null if neither is.
[[nodiscard]] inline const PairComparison* FindEitherWay(const Comparison& comparison,
                                                         const std::string& a,
                                                         const std::string& b) {
  const PairComparison* pair = comparison.FindPair(PairName(a, b));
  return pair != nullptr ? pair : comparison.FindPair(PairName(b, a));
}

}  // namespace mbv
