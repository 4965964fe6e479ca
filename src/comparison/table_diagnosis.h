// What a table that disagrees looks like: a sign, a unit, a time shift, exchanged columns. These
// cost days, and each has a plain signature.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/types.h"
#include "comparison/comparison.h"

namespace mbv {

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
