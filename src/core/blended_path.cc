#include "core/blended_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbv {
namespace {

// Straights between the points.
struct Straights {
  std::vector<VecX> direction;        // unit
  std::vector<double> length, start;  // start: σ of the first point of each, and of the end

  explicit Straights(const std::vector<VecX>& points) : start{0.0} {
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      const VecX step = points[i + 1] - points[i];
      length.push_back(step.norm());
      direction.push_back(step / length.back());
      start.push_back(start.back() + length.back());
    }
  }
  [[nodiscard]] size_t count() const { return length.size(); }
};

// σ until the speed is reached.
double RampLength(const PolylinePlan& plan) {
  const MotionLimits& l = plan.limits;
  if (!plan.s_curve) return l.v_max * l.v_max / (2.0 * l.a_max);
  const double jerk_s = std::min(l.a_max / l.j_max, std::sqrt(l.v_max / l.j_max));
  return 0.5 * l.v_max * (jerk_s + l.v_max / (l.j_max * jerk_s));
}

PolylineTrouble Overlap(const PolylinePlan& plan, const Straights& straights) {
  for (size_t i = 0; i < straights.count(); ++i) {
    const bool ends = i == 0 || i + 1 == straights.count();
    const double needed = straights.count() == 1 ? 0.0 : (ends ? 1.0 : 2.0) * plan.blend;
    if (needed <= straights.length[i]) continue;
    return {fmt::format("segment {} is {:g} m long, its blends need {:g} m", i, straights.length[i],
                        needed),
            fmt::format("blend: {:g} or less", straights.length[i] * plan.blend / needed)};
  }
  return {};
}

PolylineTrouble Sharp(const PolylinePlan& plan, const Straights& straights) {
  for (size_t i = 0; i + 1 < straights.count(); ++i) {
    const double turn = (straights.direction[i + 1] - straights.direction[i]).norm();
    const double v = plan.limits.v_max;
    const double a = 0.75 * v * v * turn / plan.blend;
    if (a <= plan.limits.a_max) continue;
    return {fmt::format("the corner at point {} takes {:.4g} m/s², which violates a_max = {:g}",
                        i + 1, a, plan.limits.a_max),
            fmt::format("v_max: {:.4g} or less, or blend: {:.4g} or more",
                        v * std::sqrt(plan.limits.a_max / a), plan.blend * a / plan.limits.a_max)};
  }
  return {};
}

PolylineTrouble LongRamps(const PolylinePlan& plan, const Straights& straights) {
  const double ramp = RampLength(plan), r = straights.count() == 1 ? 0.0 : plan.blend;
  const double shortest = straights.count() == 1
                              ? 0.5 * straights.length[0]
                              : std::min(straights.length.front(), straights.length.back()) - r;
  constexpr double kRounding = 1e-9;
  if (ramp <= (1.0 - kRounding) * shortest) return {};
  return {fmt::format("speeding up to v_max = {:g} takes {:.4g} m, the first and the last straight "
                      "have {:.4g} m",
                      plan.limits.v_max, ramp, shortest),
          "a lower v_max, a larger a_max or j_max, or a run-up before the first corner"};
}

// A piece of σ(t) along straight i: x = p_i + d_i (σ − σ_i).
Piecewise::Polynomial OnStraight(const Piecewise::Polynomial& sigma, double p, double d,
                                 double start) {
  Piecewise::Polynomial x;
  for (size_t k = 0; k < x.size(); ++k) x[k] = d * sigma[k];
  x[0] = p + d * (sigma[0] - start);
  return x;
}

class Builder {
 public:
  explicit Builder(const PolylinePlan& plan)
      : plan_(plan),
        straights_(plan.points),
        axes_(static_cast<size_t>(plan.points.front().size())) {}

  std::vector<Piecewise> Build() {
    const double total = straights_.start.back();
    const Piecewise sigma = plan_.s_curve ? SCurve(plan_.start_s, total, plan_.limits)
                                          : Trapezoid(plan_.start_s, total, plan_.limits);
    for (size_t i = 0; i < sigma.coefficients.size(); ++i) {
      AddPiece(sigma.coefficients[i], sigma.knots[i], sigma.knots[i + 1]);
    }
    for (Piecewise& axis : axes_) {
      axis.breaks = axis.knots;
      axis.knots.push_back(sigma.knots.back());
    }
    return std::move(axes_);
  }

 private:
  // Only the part at constant speed goes round corners.
  void AddPiece(Piecewise::Polynomial sigma, double from_s, double to_s) {
    const double v = sigma[1];
    while (IsCruise(sigma) && corner_ + 1 < straights_.count()) {
      const double begin = straights_.start[corner_ + 1] - plan_.blend;
      const double at_s = from_s + (begin - sigma[0]) / v;
      if (at_s >= to_s) break;
      if (at_s > from_s) AddStraight(sigma, from_s);
      AddCorner(at_s, v);
      from_s = at_s + 2.0 * plan_.blend / v;
      sigma[0] = begin + 2.0 * plan_.blend;
      ++corner_;
      if (from_s >= to_s) return;
    }
    AddStraight(sigma, from_s);
  }

  static bool IsCruise(const Piecewise::Polynomial& sigma) {
    return sigma[1] > 0.0 && sigma[2] == 0.0 && sigma[3] == 0.0;
  }

  void AddStraight(const Piecewise::Polynomial& sigma, double from_s) {
    for (size_t k = 0; k < axes_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      axes_[k].knots.push_back(from_s);
      axes_[k].coefficients.push_back(OnStraight(sigma, plan_.points[corner_][row],
                                                 straights_.direction[corner_][row],
                                                 straights_.start[corner_]));
    }
  }

  // (2) in the time since σ_0.
  void AddCorner(double from_s, double v) {
    const double r = plan_.blend, rate = v / (2.0 * r);
    const VecX& d_1 = straights_.direction[corner_];
    const VecX turn = straights_.direction[corner_ + 1] - d_1;
    const VecX x_0 = plan_.points[corner_ + 1] - r * d_1;
    for (size_t k = 0; k < axes_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const double cubic = 2.0 * r * turn[row] * rate * rate * rate;
      axes_[k].knots.push_back(from_s);
      axes_[k].coefficients.push_back(
          {x_0[row], d_1[row] * v, 0.0, cubic, -0.5 * cubic * rate, 0.0});
    }
  }

  const PolylinePlan& plan_;
  const Straights straights_;
  std::vector<Piecewise> axes_;
  size_t corner_ = 0;  // passed; also the straight that is being run
};

}  // namespace

PolylineTrouble TroubleOf(const PolylinePlan& plan) {
  const Straights straights(plan.points);
  for (const auto& find : {Overlap, Sharp, LongRamps}) {
    PolylineTrouble trouble = find(plan, straights);
    if (!trouble.text.empty()) return trouble;
  }
  return {};
}

std::vector<Piecewise> BlendedPolyline(const PolylinePlan& plan) { return Builder(plan).Build(); }

}  // namespace mbv
