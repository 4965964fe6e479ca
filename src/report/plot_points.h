// What plots draw of traces: points over time, and how many of them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "comparison/force_band.h"
#include "math/trace.h"
#include "report/report.h"

namespace mbv {

using PlotPoints = std::vector<std::pair<double, double>>;  ///< time [s], value; NaN breaks a line

/// Bins of a picture as wide as a page's.
inline constexpr size_t kPageBins = 240;

/// More points than a plot can show are thinned; the extremes of each bin are kept.
[[nodiscard]] PlotPoints Thinned(const PlotPoints& points, size_t bins = kPageBins);

/// A signal over time: where friction at rest leaves a force open, the middle of its band.
[[nodiscard]] PlotPoints ValuesOf(const Trace& trace, const ForceSignal& signal);
/// A stroke from end to end at every sample whose force friction at rest leaves open.
[[nodiscard]] PlotPoints StrokesOf(const Trace& trace, const ForceSignal& force);
/// |measured − truth| at common times: a table has fewer rows, a shorter trace ended early.
[[nodiscard]] PlotPoints DifferencesOf(const Trace& measured, int column, const Trace& truth,
                                       int truth_column);

/// The subjects whose signals share an axis.
struct SharedAxis {
  std::string unit;                   ///< SI, as channels name it
  std::vector<std::string> subjects;  ///< in the order given
};
/// Those of which the trace records this quantity, by unit, sorted by it.
[[nodiscard]] std::vector<SharedAxis> ByUnit(const Trace& trace, Quantity quantity,
                                             const std::vector<std::string>& subjects);

// Every witness against every other, where there are more than three: one number per pair.

/// No rows with up to three witnesses.
[[nodiscard]] Table PairMatrixTable(const Comparison& comparison);

}  // namespace mbv
