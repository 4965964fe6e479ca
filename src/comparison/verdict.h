// What is judged alike, whatever is compared: motions, stiffnesses, or what comes next. A
// comparison brings measurements (pairs with named metrics, checks) and words; this decides.
//
//   pairs            of witnesses: kRolePairs (core/roles.h)
//   a check          passes only if its value is a number at or below its limit
//   two against one  the two that are closest by far stand against the third
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/roles.h"

namespace mbv {

/// The entry with this name, or nullptr: witnesses and checks have `name`.
template <typename Named>
[[nodiscard]] const Named* FindNamed(const std::vector<Named>& all, const std::string& name) {
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
  return found == all.end() ? nullptr : &*found;
}
/// The pair called "measured_vs_truth", or nullptr.
template <typename Pair>
[[nodiscard]] const Pair* FindPairNamed(const std::vector<Pair>& pairs, const std::string& name) {
  const auto found = std::find_if(pairs.begin(), pairs.end(),
                                  [&](const Pair& pair) { return pair.name() == name; });
  return found == pairs.end() ? nullptr : &*found;
}

/// Of the pairs that were compared, the one that a reader looks at first; null if there is none.
template <typename Pair>
[[nodiscard]] const Pair* MainPairOf(const std::vector<Pair>& pairs) {
  for (const auto& [measured, truth] : kMainPairs) {
    const Pair* pair = FindPairNamed(pairs, PairName(*measured, *truth));
    if (pair != nullptr && pair->compared) return pair;
  }
  return nullptr;
}

/// False for NaN, and without a limit.
[[nodiscard]] inline bool Passes(double value, const std::optional<double>& limit) {
  return limit && value <= *limit;
}

/// Checks that have a limit and did not pass.
template <typename Check>
[[nodiscard]] size_t CountFailed(const std::vector<Check>& checks) {
  return static_cast<size_t>(std::count_if(checks.begin(), checks.end(),
                                           [](const Check& c) { return c.limit && !c.pass; }));
}
/// Checks that have a limit, passed, and of which `counts` holds.
template <typename Check, typename Counts>
[[nodiscard]] size_t CountPassed(const std::vector<Check>& checks, const Counts& counts) {
  return static_cast<size_t>(std::count_if(checks.begin(), checks.end(), [&](const Check& c) {
    return c.limit && c.pass && counts(c);
  }));
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

/// The third witness must be this much farther from the other two than they are from each other.
inline constexpr double kClearlyFarther = 10.0;

/// The witness that the other two stand against, of three sorted distances; "" where no two are
/// clearly closer, or there are fewer than three.
template <typename Distance>
[[nodiscard]] std::string OddOneOut(const std::vector<Distance>& sorted) {
  if (sorted.size() < 3) return "";
  const PairDistance &near = sorted[0], &far = sorted[1];
  if (!(far.value >= kClearlyFarther * near.value || std::isnan(far.value))) return "";
  for (const std::string& name : {far.measured, far.truth}) {
    if (name != near.measured && name != near.truth) return name;
  }
  return "";
}

}  // namespace mbv
