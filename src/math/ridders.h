// The slope of a function that is only known by its values.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace mbv {

/// f′(x) by central differences over ever smaller steps from `scale` on, extrapolated to none
/// [Ridders, Advances in Engineering Software 4 (1982) 75]. Of smooth functions about twelve
/// digits.
template <typename Function>
[[nodiscard]] double SlopeAt(const Function& f, double x, double scale) {
  constexpr int kSteps = 12;
  constexpr double kShrink = 1.4;
  std::array<std::array<double, kSteps>, kSteps> table{};
  double best = 0.0, error = std::numeric_limits<double>::infinity(), step = scale;
  for (int i = 0; i < kSteps; ++i, step /= kShrink) {
    auto& row = table[static_cast<size_t>(i)];
    row[0] = (f(x + step) - f(x - step)) / (2.0 * step);
    double power = kShrink * kShrink;
    for (int k = 1; k <= i; ++k, power *= kShrink * kShrink) {
      const auto at = static_cast<size_t>(k);
      const auto& before = table[static_cast<size_t>(i - 1)];
      row[at] = (power * row[at - 1] - before[at - 1]) / (power - 1.0);
      const double now =
          std::max(std::abs(row[at] - row[at - 1]), std::abs(row[at] - before[at - 1]));
      if (!(now <= error)) continue;
      error = now, best = row[at];
    }
  }
  return best;
}

}  // namespace mbv
