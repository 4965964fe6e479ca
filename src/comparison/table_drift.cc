#include "comparison/table_drift.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace mbv {
namespace {

constexpr Eigen::Index kFewest = 16;  // samples
constexpr double kLine = 0.1;         // of the difference, left beside a line
constexpr double kGrowth = 1.5;       // from each quarter of the samples to the next

}  // namespace

std::optional<GrowingDifference> FindDrift(const VecX& time_s, const VecX& difference,
                                           const std::string& unit) {
  const Eigen::Index n = difference.size();
  if (n < kFewest) return {};
  const VecX t = time_s.array() - time_s.mean();
  const double rate = t.dot(difference) / t.squaredNorm();
  const VecX line = (difference.mean() + rate * t.array()).matrix();
  const double left = Rms(difference - line), all = Rms(difference);
  if (left <= kLine * all) {
    return GrowingDifference{
        left, fmt::format("the difference grows by {:.4g} {}/s, from {:.2g} to {:.2g} {}: "
                          "a sensor's zero, or an integration? (what is left is {:.2g} "
                          "{} RMS)",
                          rate, unit, line(0), line(n - 1), unit, left, unit)};
  }
  std::array<double, 4> quarters;
  for (Eigen::Index k = 0; k < 4; ++k) {
    const Eigen::Index from = k * n / 4;
    quarters[static_cast<size_t>(k)] = Rms(difference.segment(from, (k + 1) * n / 4 - from));
  }
  for (size_t k = 1; k < 4; ++k) {
    if (!(quarters[k] >= kGrowth * quarters[k - 1])) return {};
  }
  return GrowingDifference{
      all, fmt::format("the difference grows from {:.2g} {} RMS in the first quarter of "
                       "the samples to {:.2g} {} in the last: errors of an integration "
                       "that add up, or a clock of another rate?",
                       quarters[0], unit, quarters[3], unit)};
}

}  // namespace mbv
