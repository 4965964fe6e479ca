// How the rows of a table lie in time.
#pragma once

#include <span>
#include <vector>

#include "base/types.h"
#include "scenario/tables/table.h"

// Noise of sampled signals.

namespace mbv {

/// Standard deviation of the noise in each column of `values` (rows at `time_s`, increasing): what
/// a smooth curve cannot explain. A sample is predicted from its 2, 4, … 10 nearest neighbours by
/// the polynomial through them; the median of the errors, scaled to what white noise of deviation
/// 1 would give, estimates the deviation. The truncation error of a smooth signal falls with the
/// number of neighbours while noise keeps its size, so the smallest of the estimates is taken.
/// The median makes it robust against steps and kinks. Zero with fewer than kFewestForNoise rows.
[[nodiscard]] std::vector<double> EstimateNoise(std::span<const double> time_s, const MatX& values);
inline constexpr size_t kFewestForNoise = 16;

/// Fills uniform, spacing_s and stamp_error_s from time_s (two rows at least): equal steps, equal
/// steps rounded to the printed digits, or anything else.
void DescribeTimes(ReferenceTable* table);

/// The times at which the rows were taken: evened out where only rounding makes them uneven.
[[nodiscard]] std::vector<double> TrueTimes(const ReferenceTable& table);

}  // namespace mbv
