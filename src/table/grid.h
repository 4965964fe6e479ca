// How the rows of a table lie in time.
#pragma once

#include "table/table.h"

namespace mbv {

/// Fills uniform, spacing_s and stamp_error_s from time_s (two rows at least): equal steps, equal
/// steps rounded to the printed digits, or anything else.
void DescribeTimes(ReferenceTable* table);

/// The times at which the rows were taken: evened out where only rounding makes them uneven.
[[nodiscard]] std::vector<double> TrueTimes(const ReferenceTable& table);

}  // namespace mbv
