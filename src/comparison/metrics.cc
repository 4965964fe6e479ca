#include "comparison/metrics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbv {
namespace {

// Ratio with the conventions of Nrmse(): NaN stays, 0/0 = 0, x/0 = ∞.
double Ratio(double error, double scale) {
  return error == 0.0 && scale == 0.0 ? 0.0 : error / scale;
}

// std::max, except that a NaN stays in.
double LargerOrNan(double a, double b) { return std::isnan(a) || a > b ? a : b; }

}  // namespace

void KeepWorst(Measured* worst, double value, double time_s, const std::string& channel) {
  const bool first = worst->channel.empty() && std::isnan(worst->value);
  if (!first && (std::isnan(worst->value) || value <= worst->value)) return;
  worst->value = value;
  worst->time_s = time_s;
  worst->channel = channel;
}

void KeepWorst(Measured* worst, const Measured& measured) {
  const double of_zero =
      std::isnan(worst->of_zero) ? measured.of_zero : std::max(worst->of_zero, measured.of_zero);
  const bool first = worst->channel.empty() && std::isnan(worst->value);
  if (first || (!std::isnan(worst->value) && !(measured.value <= worst->value))) *worst = measured;
  worst->of_zero = of_zero;
}

CommonSamples AlignSamples(const Trace& a, const Trace& b) {
  constexpr double kSameTime_s = 1e-9;
  CommonSamples samples;
  size_t i = 0, j = 0;
  while (i < a.time_s.size() && j < b.time_s.size()) {
    const double difference = a.time_s[i] - b.time_s[j];
    if (std::abs(difference) <= kSameTime_s) {
      samples.emplace_back(static_cast<Eigen::Index>(i++), static_cast<Eigen::Index>(j++));
    } else if (difference < 0.0) {
      ++i;
    } else {
      ++j;
    }
  }
  return samples;
}

double AngleDifference(double a, double b) { return std::remainder(a - b, 2.0 * std::numbers::pi); }

void ErrorSum::Add(double error, double truth, double time_s, const std::string& channel) {
  if (count_ == 0) worst_ = {std::abs(error), time_s, channel};
  KeepWorst(&worst_, std::abs(error), time_s, channel);
  sum_error2_ += error * error;
  sum_truth2_ += truth * truth;
  max_truth_ = LargerOrNan(std::abs(truth), max_truth_);
  ++count_;
}

void ErrorSum::Merge(const ErrorSum& other) {
  if (other.count_ == 0) return;
  if (count_ == 0) worst_ = other.worst_;
  KeepWorst(&worst_, other.worst_.value, other.worst_.time_s, other.worst_.channel);
  sum_error2_ += other.sum_error2_;
  sum_truth2_ += other.sum_truth2_;
  max_truth_ = LargerOrNan(other.max_truth_, max_truth_);
  count_ += other.count_;
}

double ErrorSum::rms_error() const {
  return count_ == 0 ? kNan : std::sqrt(sum_error2_ / static_cast<double>(count_));
}

double ErrorSum::rms_truth() const {
  return count_ == 0 ? kNan : std::sqrt(sum_truth2_ / static_cast<double>(count_));
}

double ErrorSum::Nrmse(double floor) const {
  return Ratio(rms_error(), LargerOrNan(rms_truth(), floor));
}

double ErrorSum::MaxRelative(double floor) const {
  return count_ == 0 ? kNan : Ratio(worst_.value, LargerOrNan(max_truth_, floor));
}

Measured ErrorSum::MeasuredNrmse(double floor) const {
  return {.value = Nrmse(floor),
          .time_s = worst_.time_s,
          .channel = worst_.channel,
          .floored = floor > rms_truth(),
          .of_zero = Ratio(rms_truth(), LargerOrNan(rms_truth(), floor))};
}

Measured ErrorSum::MeasuredMax(double floor) const {
  return {.value = MaxRelative(floor),
          .time_s = worst_.time_s,
          .channel = worst_.channel,
          .floored = floor > max_truth_,
          .of_zero = Ratio(max_truth_, LargerOrNan(max_truth_, floor))};
}

double MatchingDigits(double relative_error) {
  if (std::isnan(relative_error)) return kNan;
  if (relative_error <= 1e-16) return 16.0;
  return std::clamp(-std::log10(relative_error), 0.0, 16.0);
}

}  // namespace mbv
