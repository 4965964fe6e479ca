// Judging against a table: no check asks for better agreement than the table itself has.
//
// A pair with a table gets, for each metric, the value that the table's own uncertainty would
// cause; the limit is k times that where it exceeds the stated one. Pooled metrics could hide a
// precise column behind a coarse one, so each column is judged by its own tube, too:
//   RMS difference     ≤ max(k · RMS of the standard uncertainty, the stated limit in its unit)
//   largest difference ≤ max(k · largest bound, the stated limit in its unit)
#pragma once

#include <map>
#include <string>
#include <vector>

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

}  // namespace mbv
