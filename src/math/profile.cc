#include "math/profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/demand.h"
#include "math/quintic_spline.h"

namespace mbv {

Jet Evaluate(const Piecewise::Polynomial& c, double x) {
  // Horner's rule for the value and, along with it, its two derivatives.
  double value = 0.0, rate = 0.0, half = 0.0;
  for (int k = Piecewise::kDegree; k >= 0; --k) {
    half = half * x + rate;
    rate = rate * x + value;
    value = value * x + c[static_cast<size_t>(k)];
  }
  return {value, rate, 2.0 * half};
}

Jet Evaluate(const Piecewise& pieces, double t_s) {
  double t = t_s, added = 0.0;
  if (pieces.outside == Piecewise::Outside::kRepeat) {
    const double period_s = pieces.end_s() - pieces.start_s();
    const double rounds = std::floor((t_s - pieces.start_s()) / period_s);
    t -= rounds * period_s;
    added = rounds * pieces.advance;
  }
  const auto above = std::upper_bound(pieces.knots.begin() + 1, pieces.knots.end() - 1, t);
  const auto i = static_cast<size_t>(above - pieces.knots.begin()) - 1;
  const bool held = pieces.outside == Piecewise::Outside::kHold;
  const double inside = held ? std::clamp(t, pieces.start_s(), pieces.end_s()) : t;
  Jet jet = Evaluate(pieces.coefficients[i], inside - pieces.knots[i]);
  if (inside != t) jet.rate = jet.acceleration = 0.0;
  jet.value += added;
  return jet;
}

namespace {

using std::numbers::pi;

// Peak of |σ''| of the 3-4-5 polynomial: 10/√3, and its peak rate 15/8.
const double kPeakAcceleration = 10.0 / std::sqrt(3.0);
constexpr double kPeakRate = 1.875;

// σ(s) and its derivatives with respect to s, held outside [0, 1].
Jet Poly345(double s) {
  if (s <= 0.0) return {0.0, 0.0, 0.0};
  if (s >= 1.0) return {1.0, 0.0, 0.0};
  return {s * s * s * (10.0 + s * (-15.0 + 6.0 * s)), 30.0 * s * s * (1.0 - s) * (1.0 - s),
          60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)};
}

Jet Cycloid(double s) {
  if (s <= 0.0) return {0.0, 0.0, 0.0};
  if (s >= 1.0) return {1.0, 0.0, 0.0};
  return {s - std::sin(2.0 * pi * s) / (2.0 * pi), 1.0 - std::cos(2.0 * pi * s),
          2.0 * pi * std::sin(2.0 * pi * s)};
}

Jet Poly4567(double s) {
  if (s <= 0.0) return {0.0, 0.0, 0.0};
  if (s >= 1.0) return {1.0, 0.0, 0.0};
  if (s > 0.5) {  // σ(s) = 1 − σ(1 − s), without cancellation
    const Jet mirrored = Poly4567(1.0 - s);
    return {1.0 - mirrored.value, mirrored.rate, -mirrored.acceleration};
  }
  const double r = 1.0 - s, s2 = s * s;
  return {s2 * s2 * (35.0 - s * (84.0 - s * (70.0 - 20.0 * s))), 140.0 * s2 * s * r * r * r,
          420.0 * s2 * r * r * (1.0 - 2.0 * s)};
}

Jet ModifiedSine(double s) {
  if (s <= 0.0) return {0.0, 0.0, 0.0};
  if (s >= 1.0) return {1.0, 0.0, 0.0};
  constexpr double n = 4.0 + pi;
  const bool middle = s > 0.125 && s < 0.875;
  const double angle = middle ? (4.0 * pi * s + pi) / 3.0 : 4.0 * pi * s;
  const double size = middle ? 2.25 : 0.25, rate = middle ? 4.0 * pi / 3.0 : 4.0 * pi;
  const double constant = middle ? 2.0 : s <= 0.125 ? 0.0 : 4.0;
  return {(constant + pi * s - size * std::sin(angle)) / n,
          (pi - size * rate * std::cos(angle)) / n, size * rate * rate * std::sin(angle) / n};
}

// The chain rule for s = (t − start)/duration and a factor.
Jet Scale(const Jet& unit, double factor, double duration_s) {
  return {factor * unit.value, factor * unit.rate / duration_s,
          factor * unit.acceleration / (duration_s * duration_s)};
}

struct RampCruiseTimes {
  double ramp_s, ramp_length, cruise_s;
};

RampCruiseTimes TimesOf(const RampCruiseTerm& r) {
  const double T_v = kPeakAcceleration * r.v_max / (kPeakRate * r.a_max);
  const double S_v = r.v_max * T_v / kPeakRate;
  if (r.length <= S_v) return {std::sqrt(kPeakAcceleration * r.length / r.a_max), r.length, 0.0};
  return {T_v, S_v, (r.length - S_v) / r.v_max};
}

// Times of steps and samples are rounded: within this share of a time it is that time.
constexpr double kSameTime = 1e-12;

struct Evaluator {
  double t;

  Jet operator()(const ConstantTerm& c) const { return {c.value, 0.0, 0.0}; }
  Jet operator()(const RampTerm& r) const { return {r.rate * t, r.rate, 0.0}; }
  Jet operator()(const SineTerm& s) const {
    const double w = 2.0 * pi * s.frequency_hz;
    const double angle = w * t + s.phase_rad;
    return {s.amplitude * std::sin(angle), s.amplitude * w * std::cos(angle),
            -s.amplitude * w * w * std::sin(angle)};
  }
  Jet operator()(const PolyStepTerm& p) const {
    return Scale(Poly345((t - p.start_s) / p.duration_s), p.delta, p.duration_s);
  }
  Jet operator()(const Poly4567StepTerm& p) const {
    return Scale(Poly4567((t - p.start_s) / p.duration_s), p.delta, p.duration_s);
  }
  Jet operator()(const CycloidStepTerm& c) const {
    return Scale(Cycloid((t - c.start_s) / c.duration_s), c.delta, c.duration_s);
  }
  Jet operator()(const BumpTerm& b) const {
    const double s = (t - b.start_s) / b.duration_s;
    if (s <= 0.0 || s >= 1.0) return {};
    const double si = std::sin(pi * s), co = std::cos(pi * s);
    const Jet unit{si * si * si * si, 4.0 * pi * si * si * si * co,
                   4.0 * pi * pi * si * si * (3.0 * co * co - si * si)};
    return Scale(unit, b.height, b.duration_s);
  }
  Jet operator()(const RampCruiseTerm& r) const {
    const auto [ramp_s, ramp_length, cruise_s] = TimesOf(r);
    const double tau = t - r.start_s;
    const double factor = r.delta / r.length;
    if (tau <= 0.5 * ramp_s) return Scale(Poly345(tau / ramp_s), factor * ramp_length, ramp_s);
    if (tau < 0.5 * ramp_s + cruise_s) {
      return {factor * (0.5 * ramp_length + r.v_max * (tau - 0.5 * ramp_s)), factor * r.v_max, 0.0};
    }
    Jet jet = Scale(Poly345((tau - cruise_s) / ramp_s), factor * ramp_length, ramp_s);
    jet.value += factor * r.v_max * cruise_s;
    return jet;
  }
  Jet operator()(const ModifiedSineTerm& m) const {
    return Scale(ModifiedSine((t - m.start_s) / m.duration_s), m.delta, m.duration_s);
  }
  Jet operator()(const FourierTerm& f) const {
    Jet jet{f.offset, 0.0, 0.0};
    for (size_t k = 0; k < f.a.size(); ++k) {
      const double w = 2.0 * pi * f.frequency_hz * static_cast<double>(k + 1);
      const double si = std::sin(w * t), co = std::cos(w * t);
      jet.value += (f.a[k] * si - f.b[k] * co) / w;
      jet.rate += f.a[k] * co + f.b[k] * si;
      jet.acceleration += w * (f.b[k] * co - f.a[k] * si);
    }
    return jet;
  }
  Jet operator()(const PiecewiseTerm& p) const { return Evaluate(*p.pieces, t); }
  Jet operator()(const JumpTerm& j) const {
    const bool after = t >= j.at_s - kSameTime * std::max(1.0, std::abs(j.at_s));
    return {after ? j.delta : 0.0, 0.0, 0.0};
  }
};

struct BreakFinder {
  std::vector<double>* times;

  void Ends(double start_s, double duration_s) const {
    times->push_back(start_s);
    times->push_back(start_s + duration_s);
  }
  void operator()(const ConstantTerm&) const {}
  void operator()(const RampTerm&) const {}
  void operator()(const SineTerm&) const {}
  void operator()(const PolyStepTerm& p) const { Ends(p.start_s, p.duration_s); }
  void operator()(const Poly4567StepTerm& p) const { Ends(p.start_s, p.duration_s); }
  void operator()(const CycloidStepTerm& c) const { Ends(c.start_s, c.duration_s); }
  void operator()(const BumpTerm& b) const { Ends(b.start_s, b.duration_s); }
  void operator()(const RampCruiseTerm& r) const {
    const auto [ramp_s, ramp_length, cruise_s] = TimesOf(r);
    Ends(r.start_s, ramp_s + cruise_s);
    if (cruise_s > 0.0) Ends(r.start_s + 0.5 * ramp_s, cruise_s);
  }
  void operator()(const ModifiedSineTerm& m) const {
    Ends(m.start_s, m.duration_s);
    Ends(m.start_s + 0.125 * m.duration_s, 0.75 * m.duration_s);
  }
  void operator()(const FourierTerm&) const {}
  void operator()(const PiecewiseTerm& p) const {
    times->insert(times->end(), p.pieces->breaks.begin(), p.pieces->breaks.end());
  }
  void operator()(const JumpTerm& j) const { times->push_back(j.at_s); }
};

}  // namespace

std::vector<double> BreakTimes(const Profile& profile) {
  std::vector<double> times;
  for (const ProfileTerm& term : profile.terms) std::visit(BreakFinder{&times}, term);
  for (double& time_s : times) time_s -= profile.from_s;
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

std::vector<double> JumpTimes(const Profile& profile) {
  Profile jumps{.terms = {}, .from_s = profile.from_s};
  for (const ProfileTerm& term : profile.terms) {
    if (std::holds_alternative<JumpTerm>(term)) jumps.terms.push_back(term);
  }
  return BreakTimes(jumps);
}

double BeforeJump(double t_s) { return t_s - 4.0 * kSameTime * std::max(1.0, std::abs(t_s)); }

Jet Evaluate(const ProfileTerm& term, double t_s) { return std::visit(Evaluator{t_s}, term); }

Jet Evaluate(const Profile& profile, double t_s) {
  Jet sum;
  for (const ProfileTerm& term : profile.terms) {
    const Jet jet = Evaluate(term, t_s + profile.from_s);
    sum.value += jet.value;
    sum.rate += jet.rate;
    sum.acceleration += jet.acceleration;
  }
  return sum;
}

double Duration(const RampCruiseTerm& term) {
  const RampCruiseTimes times = TimesOf(term);
  return times.ramp_s + times.cruise_s;
}

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
