// Judging against a table: no check asks for better agreement than the table itself has.
//
// A pair with a table gets, for each metric, the value that the table's own uncertainty would
// cause; the limit is k times that where it exceeds the stated one. Pooled metrics could hide a
// precise column behind a coarse one, so each column is judged by its own tube, too:
//   RMS difference     ≤ max(k · RMS of the standard uncertainty, the stated limit in its unit)
//   largest difference ≤ max(k · largest bound, the stated limit in its unit)
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/types.h"
#include "comparison/comparison.h"
#include "scenario/tables/table.h"

namespace mbv {

/// True of the witness that a table stands for.
[[nodiscard]] bool IsTable(const ComparisonInput& input, const std::string& witness);

/// k · (the value of each metric that the table's uncertainty would cause) against `other`;
/// `truth` says which of the two is the pair's truth.
[[nodiscard]] std::map<Metric, double> TubeLimits(const ComparisonInput& input, const Trace& other,
                                                  bool table_is_truth);

/// k · what the uncertainty would do to the table's own commanded motion.
[[nodiscard]] std::map<Metric, double> CommandTubes(const ComparisonInput& input);

/// Every column that `other` has as well, judged by its tube; `column` chooses the stated limits.
[[nodiscard]] std::vector<TableColumnResult> JudgeColumns(const ComparisonInput& input,
                                                          const Trace& other, LimitColumn column);

/// The worst ratio of difference to tube as a metric.
[[nodiscard]] Measured WorstOf(const std::vector<TableColumnResult>& columns);

/// Why the table is too coarse to verify anything against `other`; "" if it is not.
[[nodiscard]] std::string TooCoarse(const ComparisonInput& input,
                                    const std::map<Metric, double>& tubes,
                                    const std::vector<TableColumnResult>& columns);

// What a table that disagrees looks like: a sign, a unit, a time shift, exchanged columns. These
// cost days, and each has a plain signature.

/// Explanations for the columns that leave their tube against `other`, each with the entry of the
/// scenario that would correct it. An explanation must take away at least 90 % of the difference.
[[nodiscard]] std::vector<std::string> DiagnoseTable(const ComparisonInput& input,
                                                     const Trace& other,
                                                     const std::vector<TableColumnResult>& columns);

// A difference that grows with time.

struct GrowingDifference {
  double left = kNan;  ///< RMS without it; the whole RMS where the growth follows no line
  std::string text;    ///< "the difference grows by 0.12 N/s, …"
};

/// Recognises a difference that is a line in time beside its start, and one whose size grows all
/// the way without being one.
/// \param time_s      sample times, increasing
/// \param difference  at these times, in `unit`
[[nodiscard]] std::optional<GrowingDifference> FindDrift(const VecX& time_s, const VecX& difference,
                                                         const std::string& unit);

}  // namespace mbv
