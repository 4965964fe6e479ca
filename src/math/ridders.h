// The slope of functions that are only known by their values.
#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "base/types.h"

namespace mbv {

/// f′(x) of a function with values in a vector, by central differences over ever smaller steps from
/// `scale` on, extrapolated to none [Ridders, Advances in Engineering Software 4 (1982) 75]. Of
/// smooth functions about twelve digits; NaN where f is that from some step on.
template <typename Function>
[[nodiscard]] VecX SlopesAt(const Function& f, double x, double scale) {
  constexpr size_t kSteps = 12;
  constexpr double kShrink = 1.4;
  std::array<std::array<VecX, kSteps>, kSteps> table;
  VecX best, error;
  double step = scale;
  for (size_t i = 0; i < kSteps; ++i, step /= kShrink) {
    const VecX ahead = f(x + step);
    table[i][0] = (ahead - f(x - step)) / (2.0 * step);
    if (i == 0) {
      best = VecX::Constant(ahead.size(), kNan);
      error = VecX::Constant(ahead.size(), std::numeric_limits<double>::infinity());
    }
    double power = kShrink * kShrink;
    for (size_t k = 1; k <= i; ++k, power *= kShrink * kShrink) {
      const VecX &coarse = table[i - 1][k - 1], &fine = table[i][k - 1];
      table[i][k] = (power * fine - coarse) / (power - 1.0);
      for (Eigen::Index at = 0; at < best.size(); ++at) {
        const double now =
            std::fmax(std::abs(table[i][k][at] - fine[at]), std::abs(table[i][k][at] - coarse[at]));
        if (!(now <= error[at])) continue;
        error[at] = now, best[at] = table[i][k][at];
      }
    }
  }
  return best;
}

/// Of a function with one value.
template <typename Function>
[[nodiscard]] double SlopeAt(const Function& f, double x, double scale) {
  return SlopesAt([&](double at) { return VecX(VecX::Constant(1, f(at))); }, x, scale)[0];
}

}  // namespace mbv
