// What all points of a study say together.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/types.h"
#include "features/study/design.h"

namespace mbv {

// What many values of one quantity say: percentiles, histograms, shares with their uncertainty.

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
  Interval first_interval, total_interval;  ///< 95 %, from replicates (kReplicates)
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

// A row of points.csv: what one point of a study gave.

struct PointRow {
  std::uint64_t point = 0;  ///< its number
  int exit_code = 0;        ///< as of `mbverify run`; 1: witnesses disagree, values are there
  std::string reason;       ///< why it has no values; "" if it has
  std::vector<double> varied, values = {};
};

/// "point,seed,exit,reason,…": names of factors and quantities.
[[nodiscard]] std::string PointHeader(const Study& study);
/// One line with its end; numbers in 17 digits, nothing for what is not a number.
[[nodiscard]] std::string PointLine(const PointRow& row, const Study& study);
/// Reads such a line (without its end) back; empty if it is not a row of this study.
[[nodiscard]] std::optional<PointRow> ReadPointLine(std::string_view line, const Study& study);

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

/// The widest interval of all shares and Sobol' indices; NaN where there is none.
[[nodiscard]] double WidestInterval(const StudySummary& summary);

/// Takes 8 bytes per point, for one quantity after the other. `nominal`: per quantity.
[[nodiscard]] StudySummary SummariseStudy(const Study& study, const std::vector<double>& nominal,
                                          const PointRows& rows);

}  // namespace mbv
