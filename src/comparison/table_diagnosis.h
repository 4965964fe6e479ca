// What a table that disagrees looks like: a sign, a unit, a time shift, exchanged columns. These
// cost people days, and each has a plain signature.
#pragma once

#include <string>
#include <vector>

#include "comparison/comparison.h"

namespace mbv {

/// Explanations for the columns that leave their tube against `other`, each with the entry of the
/// scenario that would mend it. An explanation must take away at least 90 % of the difference.
[[nodiscard]] std::vector<std::string> DiagnoseTable(const ComparisonInput& input,
                                                     const Trace& other,
                                                     const std::vector<TableColumnResult>& columns);

}  // namespace mbv
