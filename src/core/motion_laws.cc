#include "core/motion_laws.h"

#include <algorithm>
#include <cmath>

#include "core/demand.h"
#include "core/quintic_spline.h"

namespace mbv {
namespace {

constexpr double kNoTime = 1e-12;  // of the whole motion: an interval that round-off made

// An interval at whose start the acceleration is set; then it changes by its jerk.
struct Phase {
  double duration_s, acceleration, jerk;
};

// From rest through all phases; ends at rest at exactly `delta`.
Piecewise Integrate(double start_s, double delta, const std::vector<Phase>& phases) {
  Piecewise pieces;
  double total_s = 0.0;
  for (const Phase& phase : phases) total_s += phase.duration_s;
  double t = start_s, value = 0.0, rate = 0.0;
  for (const Phase& p : phases) {
    if (p.duration_s <= kNoTime * total_s) continue;
    pieces.knots.push_back(t);
    pieces.coefficients.push_back({value, rate, 0.5 * p.acceleration, p.jerk / 6.0, 0.0, 0.0});
    const Jet end = Evaluate(pieces.coefficients.back(), p.duration_s);
    value = end.value;
    rate = end.rate;
    t += p.duration_s;
  }
  pieces.breaks = pieces.knots;
  pieces.breaks.push_back(t);
  // What is held afterwards is the end itself, not what rounding made of it.
  pieces.knots.push_back(t);
  pieces.knots.push_back(t + total_s);
  pieces.coefficients.push_back({delta, 0.0, 0.0, 0.0, 0.0, 0.0});
  return pieces;
}

struct SCurveTimes {
  double jerk_s, ramp_s, cruise_s;
};

SCurveTimes TimesOf(double distance, const MotionLimits& limits) {
  const double j = limits.j_max;
  const double to_a = limits.a_max / j;
  double jerk_s = std::min(to_a, std::sqrt(limits.v_max / j));
  double ramp_s = jerk_s + limits.v_max / (j * jerk_s);
  const double cruise_s = distance / limits.v_max - ramp_s;
  if (cruise_s >= 0.0) return {jerk_s, ramp_s, cruise_s};
  jerk_s = std::min(to_a, std::cbrt(distance / (2.0 * j)));
  ramp_s = 0.5 * jerk_s + std::sqrt(0.25 * jerk_s * jerk_s + distance / (j * jerk_s));
  return {jerk_s, ramp_s, 0.0};
}

}  // namespace

Piecewise Trapezoid(double start_s, double delta, const MotionLimits& limits) {
  const double distance = std::abs(delta);
  const double v = std::min(limits.v_max, std::sqrt(limits.a_max * distance));
  const double ramp_s = v / limits.a_max, cruise_s = distance / v - ramp_s;
  const double a = std::copysign(limits.a_max, delta);
  return Integrate(start_s, delta, {{ramp_s, a, 0.0}, {cruise_s, 0.0, 0.0}, {ramp_s, -a, 0.0}});
}

Piecewise SCurve(double start_s, double delta, const MotionLimits& limits) {
  const auto [jerk_s, ramp_s, cruise_s] = TimesOf(std::abs(delta), limits);
  const double j = std::copysign(limits.j_max, delta), a = j * jerk_s;
  const double hold_s = ramp_s - 2.0 * jerk_s;
  return Integrate(start_s, delta,
                   {{jerk_s, 0.0, j},
                    {hold_s, a, 0.0},
                    {jerk_s, a, -j},
                    {cruise_s, 0.0, 0.0},
                    {jerk_s, 0.0, -j},
                    {hold_s, -a, 0.0},
                    {jerk_s, -a, j}});
}

Piecewise Via(const std::vector<double>& time_s, const std::vector<double>& values,
              const std::vector<bool>& rest) {
  MBV_DEMAND(time_s.size() >= 2 && values.size() == time_s.size(), time_s.size());
  Piecewise all;
  const size_t last = time_s.size() - 1;
  for (size_t from = 0, to = 1; from < last; from = to++) {
    while (to < last && !rest[to]) ++to;
    std::vector<SplineDatum> data;
    for (size_t i = from; i <= to; ++i) {
      data.push_back({.time_s = time_s[i], .value = values[i]});
      if (i != from && i != to) continue;
      data.push_back({.time_s = time_s[i], .value = 0.0, .order = 1});
      data.push_back({.time_s = time_s[i], .value = 0.0, .order = 2});
    }
    const auto begin = time_s.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end = time_s.begin() + static_cast<std::ptrdiff_t>(to) + 1;
    const Piecewise part = FitSpline({begin, end}, data);
    all.knots.insert(all.knots.end(), part.knots.begin(), part.knots.end() - 1);
    all.coefficients.insert(all.coefficients.end(), part.coefficients.begin(),
                            part.coefficients.end());
    all.breaks.push_back(time_s[from]);
  }
  all.knots.push_back(time_s.back());
  all.breaks.push_back(time_s.back());
  return all;
}

}  // namespace mbv
