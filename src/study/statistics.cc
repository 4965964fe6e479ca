#include "study/statistics.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>

namespace mbv {

double Percentile(std::span<const double> sorted, double share) {
  if (sorted.empty()) return kNan;
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(at);
  if (below + 1 >= sorted.size()) return sorted.back();
  const double part = at - static_cast<double>(below);
  return sorted[below] + part * (sorted[below + 1] - sorted[below]);
}

Interval ClopperPearson(std::uint64_t hits, std::uint64_t count, double confidence) {
  using Binomial = boost::math::binomial_distribution<double>;
  if (count == 0) return {};
  const double beyond = (1.0 - confidence) / 2.0;
  const auto n = static_cast<double>(count), k = static_cast<double>(hits);
  return {hits == 0 ? 0.0 : Binomial::find_lower_bound_on_p(n, k, beyond),
          hits == count ? 1.0 : Binomial::find_upper_bound_on_p(n, k, beyond)};
}

Histogram HistogramOf(std::span<const double> sorted) {
  constexpr double kFewest = 5, kMost = 60;
  if (sorted.empty()) return {};
  Histogram histogram{sorted.front(), sorted.back(), {}};
  const double range = histogram.to - histogram.from;
  const double middle = Percentile(sorted, 0.75) - Percentile(sorted, 0.25);
  const double width = 2.0 * middle / std::cbrt(static_cast<double>(sorted.size()));
  const double bins = width > 0.0 ? std::clamp(std::ceil(range / width), kFewest, kMost) : kFewest;
  histogram.counts.assign(range > 0.0 ? static_cast<size_t>(bins) : 1, 0);
  for (const double value : sorted) {
    const double at = range > 0.0 ? (value - histogram.from) / range * bins : 0.0;
    ++histogram.counts[std::min(static_cast<size_t>(at), histogram.counts.size() - 1)];
  }
  return histogram;
}

}  // namespace mbv
