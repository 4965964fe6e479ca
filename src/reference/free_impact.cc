// Rigid stops in free motion: the part of FreeMotion that finds when one is hit, what the impact
// does, and what stays in touch.
//
// A gap is the way to an end, upper − q or q − lower; γ is its gradient along the motions R that
// loops and commands leave, H = RᵀM R. Forces are finite and exert no impulse, stops do:
//   u⁺ = u⁻ + H⁻¹ Σ γ_k p_k,  γᵀu⁺ = −ε γᵀu⁻ of what is hit, 0 of what is in touch,  p_k >= 0   (1)
// (Newton's law of impact [Brogliato 2016, ch. 4]). What rebounds more slowly than its rest rate
// stays in touch: it is held as a coordinate at rest, with the force N that keeps it there,
//   N_k >= 0,  and the gaps of those that are let go open                                       (2)
#include <fmt/format.h>
#include <Eigen/Cholesky>

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <utility>

#include "reference/closure_solver.h"
#include "reference/element_forces.h"
#include "reference/force_solver.h"
#include "reference/free_motion.h"
#include "reference/square_system.h"

namespace mbv::internal {
namespace {

// Places within a step at which a gap is looked at on its cubic.
constexpr int kGapLooks = 16;
constexpr int kGapHalvings = 40;
constexpr std::uintmax_t kGapTries = 100;
// A gap is open within this [characteristic lengths, rad]; a start that is farther beyond is none.
constexpr double kGapOpen = 1e-12;
// Impacts from one sample to the next.
constexpr int kMostImpacts = 1000;
// A smaller share of the largest is no force, no impulse, no rate.
constexpr double kNoShare = 1e-9;

Happening HitOf(int side) { return side > 0 ? Happening::kHitsUpper : Happening::kHitsLower; }
Happening TouchOf(int side) { return side > 0 ? Happening::kUpperEnd : Happening::kLowerEnd; }

}  // namespace

void FreeMotion::FindEnds() {
  for (size_t e = 0; e < mechanism_.elements.size(); ++e) {
    const auto* stop = std::get_if<StopLaw>(&mechanism_.elements[e].law);
    if (stop == nullptr || !stop->rigid()) continue;
    if (std::isfinite(stop->upper)) ends_.push_back({e, 1});
    if (std::isfinite(stop->lower)) ends_.push_back({e, -1});
  }
}

FreeMotion::Gap FreeMotion::GapOf(const End& end, const BodyStates& states) const {
  const auto& stop = std::get<StopLaw>(mechanism_.elements[end.element].law);
  const ScalarRow row = ElementRow(mechanism_, end.element, states);
  const double way = end.side > 0 ? stop.upper - row.value : row.value - stop.lower;
  return {way, -end.side * RateOf(row, states.V_WB)};
}

double FreeMotion::Touches(const End& end) const {
  const bool length = ActsOnLength(mechanism_, mechanism_.elements[end.element]);
  return kGapOpen * (length ? dynamics_.length() : 1.0);
}

RunSummary FreeMotion::StartStops() {
  std::vector<End> hits, touching;
  for (const End& end : ends_) {
    log_.Note(mechanism_.elements[end.element], 0.0, Happening::kFree);
    const Gap gap = GapOf(end, now_.states);
    if (gap.way > Touches(end)) continue;
    if (gap.way < -Touches(end)) {
      const ForceElement& element = mechanism_.elements[end.element];
      return {.stop = Stop::kUnsupported,
              .message = fmt::format("the start is {:.3g} {} beyond an end of the {} ('{}')",
                                     -gap.way, ActsOnLength(mechanism_, element) ? "m" : "rad",
                                     Described(mechanism_, element), element.name),
              .time_s = 0.0,
              .where = element.name,
              .names_where = true};
    }
    const double rest = RestRate(mechanism_, mechanism_.elements[end.element], duration_s_);
    if (gap.rate <= rest) (gap.rate < -rest ? hits : touching).push_back(end);
  }
  if (!hits.empty()) return Strike(hits);
  return touching.empty() ? RunSummary::Done() : KeepInTouch(std::move(touching));
}

// The first impact within a step, or, of what is in touch, the first that a force would pull.
std::optional<FreeMotion::ImpactEvent> FreeMotion::FirstImpact(double h, const State& to) {
  ImpactEvent first{.after_s = h};
  bool found = false;
  const State from = Pack(now_);
  const auto at = [&](double t) {
    BodyStates states = StatesOf(StepFrom(from, t));
    return states;
  };
  const auto root = [&](const auto& f, double a, double b) {
    const double at_a = f(a), at_b = f(b);
    if (at_a * at_b >= 0.0) return at_a <= 0.0 ? a : b;
    std::uintmax_t tries = kGapTries;
    const auto [low, high] = boost::math::tools::toms748_solve(
        f, a, b, at_a, at_b, boost::math::tools::eps_tolerance<double>(), tries);
    return 0.5 * (low + high);
  };
  const BodyStates end_states = StatesOf(to);
  for (const End& end : ends_) {
    if (IsInTouch(end)) continue;
    const double open = -Touches(end);
    const Gap a = GapOf(end, now_.states), b = GapOf(end, end_states);
    // Where it was hit last, the gap is closed but for round-off.
    const double closed = std::min(0.0, a.way);
    const auto gap = [&](double t) { return GapOf(end, at(t)).way - closed; };
    double beyond = b.way < open ? h : -1.0;
    for (int i = 1; i < kGapLooks && beyond < 0.0; ++i) {
      const double t = h * i / kGapLooks;
      if (Cubic(h, t, a.way, a.rate, b.way, b.rate) < open && gap(t) < open) beyond = t;
    }
    if (beyond < 0.0) continue;
    // No flight in between is resolved where there is no such time before.
    double before = a.way > 0.0 ? 0.0 : -1.0, t = beyond;
    for (int i = 0; i < kGapHalvings && before < 0.0; ++i) {
      t *= 0.5;
      if (gap(t) > 0.0) before = t;
    }
    const double after = before < 0.0 ? 0.0 : root(gap, before, beyond);
    if (found && after > first.after_s) continue;
    if (!found || after < first.after_s) first = {.after_s = after, .hits = {}, .leaves = {}};
    first.hits.push_back(end);
    found = true;
  }
  if (!in_touch_.empty()) {
    const auto least = [&](double t) {
      BodyStates states = at(t);
      if (!dynamics_.Accelerate(time_(now_.time_s + t), &states).ok()) return 1.0;
      return TouchForces().minCoeff();
    };
    double before = 0.0, beyond = h;
    bool pulls = least(h) < 0.0;
    for (int i = 0; i < kGapHalvings && pulls; ++i) {
      const double t = 0.5 * (before + beyond);
      (least(t) < 0.0 ? beyond : before) = t;
    }
    pulls = pulls && (!found || beyond < first.after_s) && least(beyond) < 0.0;
    if (pulls) {
      first = {.after_s = beyond};
      const VecX force = TouchForces();
      for (size_t k = 0; k < in_touch_.size(); ++k) {
        if (force[static_cast<Eigen::Index>(k)] < 0.0) first.leaves.push_back(in_touch_[k]);
      }
      found = true;
    }
  }
  trouble_ = RunSummary::Done();
  if (!found) return {};
  return first;
}

RunSummary FreeMotion::LetGo(const std::vector<End>& leaves) {
  std::vector<End> stay;
  for (const End& end : in_touch_) {
    const bool leaves_now =
        std::ranges::any_of(leaves, [&](const End& one) { return one.element == end.element; });
    if (!leaves_now) stay.push_back(end);
  }
  return KeepInTouch(std::move(stay));
}

bool FreeMotion::IsInTouch(const End& end) const {
  return std::ranges::any_of(in_touch_, [&](const End& one) {
    return one.element == end.element && one.side == end.side;
  });
}

// Of what is in touch, by the last Accelerate(): what pushes the gaps open.
VecX FreeMotion::TouchForces() const {
  const RestSystem& rest = dynamics_.rest();
  const Eigen::LDLT<MatX> H(rest.H);
  const MatX A = rest.G * H.solve(MatX(rest.G.transpose()));
  VecX force = -A.ldlt().solve(VecX(rest.G * H.solve(rest.f) + rest.d));
  for (size_t k = 0; k < in_touch_.size(); ++k)
    force[static_cast<Eigen::Index>(k)] *= -in_touch_[k].side;
  return force;
}

void FreeMotion::HoldTouch() {
  FrictionPhase phase;
  phase.sign.assign(mechanism_.elements.size(), 0);
  std::ranges::sort(in_touch_, {}, &End::element);
  for (const End& end : in_touch_) {
    const auto& stop = std::get<StopLaw>(mechanism_.elements[end.element].law);
    phase.held.push_back(end.element);
    phase.at.push_back(end.side > 0 ? stop.upper : stop.lower);
  }
  dynamics_.SetPhase(std::move(phase));
}

// (2), from those that may stay.
RunSummary FreeMotion::KeepInTouch(std::vector<End> may_stay) {
  in_touch_ = std::move(may_stay);
  HoldTouch();
  std::vector<End> let_go;
  while (!in_touch_.empty()) {
    BodyStates states = now_.states;
    if (RunSummary summary = dynamics_.Accelerate(now_.time_s, &states); !summary.ok()) {
      return summary;
    }
    const VecX force = TouchForces();
    Eigen::Index worst = 0;
    if (!(force.minCoeff(&worst) < -kNoShare * force.cwiseAbs().maxCoeff())) break;
    let_go.push_back(in_touch_[static_cast<size_t>(worst)]);
    in_touch_.erase(in_touch_.begin() + worst);
    HoldTouch();
  }
  if (!in_touch_.empty()) {
    if (RunSummary summary = dynamics_.Project(now_.time_s, &now_.states); !summary.ok()) {
      return summary;
    }
  }
  if (RunSummary summary = dynamics_.Accelerate(now_.time_s, &now_.states); !summary.ok()) {
    return summary;
  }
  for (const End& end : let_go) {
    const ScalarRow row = ElementRow(mechanism_, end.element, now_.states);
    const double opens = -end.side * (RateOf(row, now_.states.A_WB) + row.bias);
    const double size = std::abs(RateOf(row, now_.states.A_WB)) + std::abs(row.bias);
    if (opens >= -kNoShare * size) continue;
    return Contradiction(
        end.element, "neither stays in touch nor leaves, with others in touch", opens,
        ActsOnLength(mechanism_, mechanism_.elements[end.element]) ? "m/s²" : "rad/s²");
  }
  for (const End& end : ends_) {
    if (IsInTouch(end)) {
      log_.Note(mechanism_.elements[end.element], now_.time_s, TouchOf(end.side));
    } else if (std::ranges::none_of(in_touch_,
                                    [&](const End& one) { return one.element == end.element; })) {
      log_.Note(mechanism_.elements[end.element], now_.time_s, Happening::kFree);
    }
  }
  return RunSummary::Done();
}

// (1)
RunSummary FreeMotion::Strike(const std::vector<End>& hits) {
  if (++impacts_here_ > kMostImpacts) {
    return Contradiction(hits.front().element, "is hit again and again", impacts_here_, "times");
  }
  std::vector<End> held = in_touch_, slow;
  in_touch_.clear();
  HoldTouch();
  dynamics_.Factor(now_.time_s, now_.states);
  const MatX R = dynamics_.Motions();
  const Eigen::LDLT<MatX> H(MatX(R.transpose() * Momenta(mechanism_, now_.states, R)));
  for (;;) {
    slow.clear();
    std::vector<End> all = hits;
    all.insert(all.end(), held.begin(), held.end());
    const auto count = static_cast<Eigen::Index>(all.size());
    MatX gamma(R.cols(), count);
    VecX change(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const End& end = all[static_cast<size_t>(k)];
      const ScalarRow row = ElementRow(mechanism_, end.element, now_.states);
      if (dynamics_.ShareLeft(row) < kNoShare) {
        return Contradiction(end.element,
                             "is hit by a commanded coordinate, which no impulse stops",
                             GapOf(end, now_.states).rate, "per second");
      }
      gamma.col(k) = -end.side * (R.transpose() * GradientOf(row, mechanism_.bodies.size()));
      const double rate = GapOf(end, now_.states).rate;
      const double restitution =
          std::get<StopLaw>(mechanism_.elements[end.element].law).restitution;
      const bool is_hit = k < static_cast<Eigen::Index>(hits.size());
      const bool rests = !is_hit || rate >= 0.0 ||
                         std::abs(restitution * rate) <=
                             RestRate(mechanism_, mechanism_.elements[end.element], duration_s_);
      if (rests && is_hit) slow.push_back(end);
      change[k] = (rests ? 0.0 : -restitution * rate) - rate;
    }
    const MatX spread = H.solve(gamma);
    const VecX impulse = MatX(gamma.transpose() * spread).ldlt().solve(change);
    const double none = -kNoShare * impulse.cwiseAbs().maxCoeff();
    std::optional<size_t> pulled;
    for (size_t k = 0; k < all.size(); ++k) {
      const bool unresolved = k < hits.size() && GapOf(all[k], now_.states).rate >= 0.0;
      if (impulse[static_cast<Eigen::Index>(k)] < none && !unresolved) pulled = k;
    }
    if (pulled && *pulled < hits.size()) {
      return Contradiction(all[*pulled].element,
                           "and others are hit at once, and the order is not determined",
                           impulse[static_cast<Eigen::Index>(*pulled)], "N s");
    }
    if (pulled) {  // what is in touch is not pulled: without it
      held.erase(held.begin() + static_cast<long>(*pulled - hits.size()));
      continue;
    }
    const double energy = EnergyOf(mechanism_, now_.states).kinetic;
    Unstack(VecX(Stack(now_.states.V_WB) + R * (spread * impulse)), &now_.states.V_WB);
    now_.work[now_.work.size() - 1] += EnergyOf(mechanism_, now_.states).kinetic - energy;
    break;
  }
  for (const End& end : hits) {
    log_.Add(mechanism_.elements[end.element], now_.time_s, HitOf(end.side));
  }
  nodes_.clear();
  held.insert(held.end(), slow.begin(), slow.end());
  return KeepInTouch(std::move(held));
}

}  // namespace mbv::internal
