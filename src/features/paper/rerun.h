// A result against its repetition, by the same program on another day or machine: judged by the
// tubes that tables are judged by (table_tube.h), column by column.
//
// A repetition differs by round-off alone: libraries of mathematics round differently on other
// machines. Computations without an engine may differ by as much as two of them may (the scenario's
// own limits, far above round-off). The limits of a simulation stand for what its engine's model
// leaves out; a repetition leaves out the same and may use a hundredth of them, so that no check
// moves by more than a hundredth of its limit. A limit that is switched off is the default one
// here.
#pragma once

#include <string>
#include <vector>

#include "comparison/comparison.h"

namespace mbv {

/// The share of an engine's limits that a repetition may use.
inline constexpr double kRerunShare = 0.01;

/// The limits that repetitions are judged by.
[[nodiscard]] CheckLimits RerunLimits(const CheckLimits& limits);

/// One signal.
struct RerunSignal {
  std::string signal;      ///< "motor.force.simulated"
  double relative = kNan;  ///< largest difference over the signal's largest value; 0/0 is 0
  double use = kNan;       ///< share of its tube that it takes: at most 1; NaN is outside
  double time_s = kNan;    ///< of the largest difference; NaN where there is no time
  [[nodiscard]] bool inside() const { return use <= 1.0; }
};

/// Every channel of `packed` against the one of the same name; both as files show them
/// (AsShown()), with the same channels and times. What neither knows (NaN) is the same.
[[nodiscard]] std::vector<RerunSignal> CompareReruns(const ComparisonInput& input, Trace packed,
                                                     Trace rerun, LimitColumn column);

/// Two columns of numbers by one limit of their largest difference: over the column's largest
/// value, or as it is (`absolute`).
[[nodiscard]] RerunSignal CompareColumns(const std::string& name, const std::vector<double>& packed,
                                         const std::vector<double>& rerun, double limit,
                                         bool absolute = false);

}  // namespace mbv
