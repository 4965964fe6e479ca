// Time derivatives from sixth-order differences, and twists from poses alone.
#pragma once

#include <functional>

#include "base/types.h"

namespace mbv::stabilizing_platform {

// Sixth-order central differences. With h = 5 ms on motions of up to 3 × 1.6 rad/s and size
// S the truncation is below 1e-13 S, and roundoff 2 ε S/h and 5 ε S/h² dominates.
inline constexpr double kStep = 5e-3;
template <typename F>
auto Rate(F f, double t) {
  const double h = kStep;
  return ((45 * (f(t + h) - f(t - h)) - 9 * (f(t + 2 * h) - f(t - 2 * h)) +
           (f(t + 3 * h) - f(t - 3 * h))) /
          (60 * h))
      .eval();
}
template <typename F>
auto Acceleration(F f, double t) {
  const double h = kStep;
  return ((270 * (f(t + h) + f(t - h)) - 27 * (f(t + 2 * h) + f(t - 2 * h)) +
           2 * (f(t + 3 * h) + f(t - 3 * h)) - 490 * f(t)) /
          (180 * h * h))
      .eval();
}
// Limits for quantities of size S whose samples carry roundoff of k ε S.
inline double RateLimit(double size) { return 20 * 2 * kEps * size / kStep; }
inline double AccelerationLimit(double size) { return 20 * 5 * kEps * size / (kStep * kStep); }

// The twist about the earth's origin from poses alone: V× = X' X⁻¹.
inline Vec6 TwistFromPoses(const std::function<Pose(double)>& X, double t) {
  auto matrix = [&](double s) -> Eigen::Matrix4d { return X(s).matrix(); };
  const Eigen::Matrix4d V = Rate(matrix, t) * X(t).inverse().matrix();
  Vec6 twist;
  twist << V(2, 1), V(0, 2), V(1, 0), V(0, 3), V(1, 3), V(2, 3);
  return twist;
}

}  // namespace mbv::stabilizing_platform
