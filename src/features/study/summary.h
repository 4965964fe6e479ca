// What all points of a study say together.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "features/study/point_row.h"
#include "features/study/statistics.h"

namespace mbv {

/// Calls its argument with every row of a study, in the order of their numbers; as often as asked.
using PointRows = std::function<void(const std::function<void(const PointRow&)>&)>;

struct WorstPoint {
  std::uint64_t point = 0;
  double value = kNan;
  std::vector<double> varied;
};

/// A number that alone was varied: what a quantity came to at its excursions.
struct Swing {
  size_t factor = 0;
  double lowest = kNan, highest = kNan;
};

struct QuantitySummary {
  std::string name;
  double nominal = kNan;                 ///< with nothing varied
  std::uint64_t count = 0, missing = 0;  ///< points with and without a value
  double mean = kNan, deviation = kNan;  ///< standard deviation, of a sample
  double least = kNan, most = kNan;
  double p50 = kNan;
  /// Percentiles of all points; NaN of fewer than kFewestForPercentiles.
  double p5 = kNan, p95 = kNan;
  Histogram histogram;
  std::vector<WorstPoint> worst;     ///< at most kWorstPoints, the worst one first
  std::optional<SobolResult> sobol;  ///< of Saltelli's design
  std::vector<Swing> swings;         ///< of one at a time, the widest first
};
inline constexpr size_t kWorstPoints = 3;
/// Of fewer values one in twenty is none: 5 % and 95 % would be the least and the most.
inline constexpr size_t kFewestForPercentiles = 20;

struct LimitResult {
  StudyLimit limit;
  std::uint64_t violations = 0, count = 0;  ///< points without a value violate
  /// Of the share, as of independent points; NaN where they are not drawn, or repeat each other's
  /// numbers.
  Interval interval;
  [[nodiscard]] double share() const {
    return count == 0 ? kNan : static_cast<double>(violations) / static_cast<double>(count);
  }
  [[nodiscard]] bool pass() const { return share() <= limit.share; }
};

struct StudySummary {
  std::uint64_t points = 0, failed = 0;          ///< rows, and those with a reason
  std::uint64_t disagreed = 0;                   ///< at which witnesses disagree
  std::vector<PointRow> first_disagreed;         ///< at most kWorstPoints
  std::map<std::string, std::uint64_t> reasons;  ///< at most kReasons, and how often
  std::vector<PointRow> first_failed;            ///< at most kWorstPoints
  std::vector<QuantitySummary> quantities;
  std::vector<LimitResult> limits;

  std::optional<double> missing;  ///< Study::missing

  [[nodiscard]] bool any_value() const { return failed < points; }
  [[nodiscard]] bool few_missing() const {
    return !missing || static_cast<double>(failed) <= *missing * static_cast<double>(points);
  }
  [[nodiscard]] bool within_limits() const;
};
inline constexpr size_t kReasons = 20;  ///< others count under "…"

/// Takes 8 bytes per point, for one quantity after the other. `nominal`: per quantity.
[[nodiscard]] StudySummary SummariseStudy(const Study& study, const std::vector<double>& nominal,
                                          const PointRows& rows);

}  // namespace mbv
