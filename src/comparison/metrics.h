// Error measures between two traces sampled at the same times.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/types.h"
#include "math/trace.h"

namespace mbv {

/// A measured quantity and where it is worst. NaN until measured; NaN never passes a check.
struct Measured {
  double value = kNan;
  double time_s = kNan;
  std::string channel = {};
  bool floored = false;   ///< relative to a floor that is larger than the quantity itself
  double of_zero = kNan;  ///< value if zero had been measured everywhere: at most 1
};

/// Keeps the larger one; a NaN stays once it is in.
void KeepWorst(Measured* worst, double value, double time_s, const std::string& channel);
/// The same with floors; the largest `of_zero` of all is kept.
void KeepWorst(Measured* worst, const Measured& measured);

/// Rows (of a, of b) that share a sample time, to 1e-9 s. Nothing is interpolated.
using CommonSamples = std::vector<std::pair<Eigen::Index, Eigen::Index>>;
[[nodiscard]] CommonSamples AlignSamples(const Trace& a, const Trace& b);

/// a − b in (−π, π].
[[nodiscard]] double AngleDifference(double a, double b);

/// Sums of a measured signal against its truth.
class ErrorSum {
 public:
  /// One sample; `error` is measured − truth.
  void Add(double error, double truth, double time_s, const std::string& channel);
  void Merge(const ErrorSum& other);

  [[nodiscard]] double rms_error() const;
  [[nodiscard]] double rms_truth() const;
  [[nodiscard]] double max_error() const { return worst_.value; }
  [[nodiscard]] double worst_time_s() const { return worst_.time_s; }
  [[nodiscard]] const std::string& worst_channel() const { return worst_.channel; }
  [[nodiscard]] size_t count() const { return count_; }

  /// RMS error / max(RMS truth, floor); 0/0 is 0 (both signals vanish), x/0 is infinite.
  [[nodiscard]] double Nrmse(double floor = 0.0) const;
  /// Largest error / max(largest truth, floor), same conventions.
  [[nodiscard]] double MaxRelative(double floor = 0.0) const;
  /// Both with place, floor and value of zero.
  [[nodiscard]] Measured MeasuredNrmse(double floor) const;
  [[nodiscard]] Measured MeasuredMax(double floor) const;

 private:
  double sum_error2_ = 0.0, sum_truth2_ = 0.0, max_truth_ = 0.0;
  size_t count_ = 0;
  Measured worst_{.value = 0.0, .time_s = kNan};
};

/// Decimal digits that agree, from a relative error: −log10, 0 … 16; NaN stays NaN.
[[nodiscard]] double MatchingDigits(double relative_error);

}  // namespace mbv
