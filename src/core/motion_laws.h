// Laws of motion made of polynomials: point to point within limits, and through given points.
#pragma once

#include <vector>

#include "core/piecewise.h"

namespace mbv {

/// What a motion from rest to rest may reach.
struct MotionLimits {
  double v_max = 0.0;  ///< > 0
  double a_max = 0.0;  ///< > 0
  double j_max = 0.0;  ///< > 0; S-curve only
};

/// Shortest motion by `delta` with |rate| <= v_max and |acceleration| <= a_max: constant
/// acceleration, cruise, the same deceleration; no cruise where v_max is not reached
/// (|delta| <= v_max²/a_max). Breaks: where the acceleration jumps.
[[nodiscard]] Piecewise Trapezoid(double start_s, double delta, const MotionLimits& limits);

/// The same with |jerk| <= j_max: seven intervals of constant jerk +j 0 −j | 0 | −j 0 +j. With
/// T_j the time of each jerk and T_a that of the whole acceleration,
///   v_max reached:  T_j = min(a_max/j, √(v_max/j)),  T_a = T_j + v_max/(j T_j),
///                   T_v = |delta|/v_max − T_a >= 0
///   not reached:    T_v = 0, T_j = min(a_max/j, ∛(|delta|/2j)),
///                   T_a = T_j/2 + √(T_j²/4 + |delta|/(j T_j))
/// [Biagiotti 2008, §3.4]. Intervals that come to nothing are left out.
[[nodiscard]] Piecewise SCurve(double start_s, double delta, const MotionLimits& limits);

/// Through values[i] at time_s[i] (two at least) with four continuous derivatives between rests;
/// at rest (rate and acceleration zero) at the first and the last, and where `rest` says so.
[[nodiscard]] Piecewise Via(const std::vector<double>& time_s, const std::vector<double>& values,
                            const std::vector<bool>& rest);

}  // namespace mbv
