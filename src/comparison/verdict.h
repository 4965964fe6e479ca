// What is judged alike, whatever is compared: motions, stiffnesses, or what comes next.
//
//   a check          passes only if its value is a number at or below its limit
//   two against one  those that are closest by far stand against the one that is left
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/roles.h"
#include "comparison/comparison.h"

// Single numbers out of a comparison.

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

/// The entry with this name, or nullptr: witnesses and checks have `name`.
template <typename Named>
[[nodiscard]] const Named* FindNamed(const std::vector<Named>& all, const std::string& name) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
  return found == all.end() ? nullptr : &*found;
}
/// False for NaN, and without a limit.
[[nodiscard]] inline bool Passes(double value, const std::optional<double>& limit) {
  return limit && value <= *limit;
}

/// How far two witnesses are from each other, by one measure.
struct PairDistance {
  std::string measured, truth;
  double value = 0.0;  ///< NaN is farthest

  [[nodiscard]] std::string name() const { return PairName(measured, truth); }
};

/// Nearest first.
template <typename Distance>
void SortByDistance(std::vector<Distance>* distances) {
  const auto key = [](const Distance& d) { return std::isnan(d.value) ? 1e300 : d.value; };
  std::stable_sort(distances->begin(), distances->end(),
                   [&](const Distance& a, const Distance& b) { return key(a) < key(b); });
}

/// The odd one must be farther by this factor from each other witness than they are from each
/// other.
inline constexpr double kClearlyFarther = 10.0;

/// The nearest pair in which a witness takes part, of sorted distances; null if there is none.
template <typename Distance>
[[nodiscard]] const Distance* NearestOf(const std::string& witness,
                                        const std::vector<Distance>& sorted) {
  const auto found = std::find_if(sorted.begin(), sorted.end(), [&](const Distance& d) {
    return d.measured == witness || d.truth == witness;
  });
  return found == sorted.end() ? nullptr : &*found;
}

/// The witness that all others stand against, of three or more sorted distances; "" where the
/// others are not clearly closer to each other.
template <typename Distance>
[[nodiscard]] std::string OddOneOut(const std::vector<Distance>& sorted) {
  if (sorted.size() < 3) return "";
  const PairDistance& nearest = sorted.front();
  for (const Distance& pair : sorted) {
    for (const std::string& name : {pair.measured, pair.truth}) {
      if (name == nearest.measured || name == nearest.truth) continue;
      const double far = NearestOf(name, sorted)->value;
      double among_others = nearest.value;  // the farthest pair without it
      for (const Distance& other : sorted) {
        if (other.measured != name && other.truth != name) among_others = other.value;
      }
      if (far >= kClearlyFarther * among_others || std::isnan(far)) return name;
    }
  }
  return "";
}

}  // namespace mbv
