// Stick and slip in free motion: the part of FreeMotion that finds when phases of friction end, and
// what follows.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/tools/minima.hpp>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <utility>

#include "kinematics/constraints.h"
#include "reference/closure_solver.h"
#include "reference/free_dynamics.h"
#include "reference/free_motion.h"
#include "reference/square_system.h"

namespace mbv::internal {
namespace {

// Places within a step at which rates and loads are looked at on cubics.
constexpr int kRateLooks = 16, kLoadLooks = 4;
// Held elements start where the load exceeds what friction takes by more than round-off.
constexpr double kExceeds = 1e-11;
// A rate counts as zero within this many tolerances of a step [characteristic lengths/s, rad/s].
constexpr double kUnresolved = 10.0;
// What starts is decided by the load that the held motion has this share of a step later: at the
// start itself nothing moves yet.
constexpr double kAhead = 1e-4;
// A coordinate of which loops and commands leave a smaller share to forces is prescribed by them,
// or stands at its dead centre.
constexpr double kPrescribed = 1e-9;
// Where it is, it is so at a pose this far away as well [rad, characteristic lengths].
constexpr double kAside = 1e-2;
// A smaller share of what a rate or an acceleration is made of is none.
constexpr double kTurns = 1e-9;
constexpr int kMostHalvings = 40;
constexpr std::uintmax_t kMostTries = 100;

// Where f, of different signs at both ends, vanishes.
template <typename F>
double Root(const F& f, double a, double b) {
  const double at_a = f(a), at_b = f(b);
  if (at_a == 0.0) return a;
  if (at_b == 0.0) return b;
  std::uintmax_t passes = kMostTries;
  const auto [low, high] = boost::math::tools::toms748_solve(
      f, a, b, at_a, at_b, boost::math::tools::eps_tolerance<double>(), passes);
  return 0.5 * (low + high);
}

// What J · twists of a row would be if its bodies moved as much as any.
double MostOf(const ScalarRow& row, const std::vector<Vec6>& twists, double length) {
  const auto size = [](const Vec6& twist, double scale) {
    return std::hypot(scale * twist.head<3>().norm(), twist.tail<3>().norm());
  };
  double most = 0.0;
  for (const Vec6& twist : twists) most = std::max(most, size(twist, length));
  return (size(row.J_parent, 1.0 / length) + size(row.J_child, 1.0 / length)) * most;
}

int SignOf(double value, double least) {
  return std::abs(value) > least ? (value > 0.0 ? 1 : -1) : 0;
}

}  // namespace

double Cubic(double h, double t, double v0, double a0, double v1, double a1) {
  const double s = t / h, r = 1.0 - s;
  return r * r * ((1.0 + 2.0 * s) * v0 + t * a0) + s * s * ((1.0 + 2.0 * r) * v1 - (h - t) * a1);
}

BodyStates FreeMotion::StatesOf(const State& x) const {
  BodyStates states = now_.states;
  Unpack(x, &states, nullptr);
  FollowElements(mechanism_, &states);
  return states;
}

VecX FreeMotion::ElementRates(const BodyStates& states) const {
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, states);
  VecX rates(static_cast<Eigen::Index>(rows.size()));
  for (size_t e = 0; e < rows.size(); ++e) {
    rates[static_cast<Eigen::Index>(e)] = RateOf(rows[e], states.V_WB);
  }
  return rates;
}

double FreeMotion::Resolved(size_t element) const {
  const bool length = ActsOnLength(mechanism_, mechanism_.elements[element]);
  return kUnresolved * tolerance_ * (length ? dynamics_.length() : 1.0);
}

RunSummary FreeMotion::Contradiction(size_t element, const std::string& what, double amount,
                                     const std::string& unit) const {
  const ForceElement& at = mechanism_.elements[element];
  return {.stop = Stop::kNoConvergence,
          .message = fmt::format("{} ('{}') {} at t = {:.6g} s", Described(mechanism_, at), at.name,
                                 what, now_.time_s),
          .time_s = now_.time_s,
          .where = at.name,
          .amount = amount,
          .unit = unit,
          .names_where = true,
          .states_time = true};
}

// At its dead centre a coordinate is at rest, as loops and commands have it, but forces neither
// move nor hold it: its share there is round-off of the pose.
bool FreeMotion::AtDeadCentre(const ScalarRow& row) const {
  return dynamics_.ShareLeft(row) < kPrescribed;
}

// Its rate is within the error of DOFs at rest, or, at a dead centre, within round-off.
bool FreeMotion::Rests(size_t element, const ScalarRow& row) const {
  const std::vector<Vec6>& V_WB = now_.states.V_WB;
  const double least = AtDeadCentre(row) ? kTurns * MostOf(row, V_WB, dynamics_.length())
                                         : Resolved(element) * dynamics_.ShareLeft(row);
  return std::abs(RateOf(row, V_WB)) <= least;
}

// Elements whose coordinate loops and commands prescribe, at this pose and next to it.
std::vector<size_t> FreeMotion::PrescribedElements() {
  std::vector<size_t> prescribed;
  const auto keep_prescribed = [&](const BodyStates& states, std::vector<size_t> of) {
    const std::vector<ScalarRow> rows = ElementRows(mechanism_, states);
    std::erase_if(of, [&](size_t e) { return !AtDeadCentre(rows[e]); });
    return of;
  };
  dynamics_.Factor(now_.time_s, now_.states);
  prescribed = keep_prescribed(now_.states, friction_elements_);
  VecX aside = dynamics_.Motions() * VecX::Ones(dynamics_.dofs());
  aside *= kAside / SizeOf(aside, dynamics_.length());
  for (const double sense : {1.0, -1.0}) {
    if (prescribed.empty()) break;
    BodyStates states = now_.states;
    MoveBodies(sense * aside, &states);
    if (dynamics_.Project(now_.time_s, &states).ok())
      prescribed = keep_prescribed(states, prescribed);
  }
  return prescribed;
}

// Elements whose coordinate moves by forces are at rest where their rate does not differ from zero;
// commands lead the others.
RunSummary FreeMotion::BeginFriction() {
  FrictionEvent start;
  FrictionPhase phase;
  phase.sign.assign(mechanism_.elements.size(), 0);
  phase.prescribed = PrescribedElements();
  std::erase_if(friction_elements_,
                [&](size_t e) { return std::ranges::count(phase.prescribed, e) > 0; });
  all_friction_ = friction_elements_;
  off_ = SwitchedOff(motion_, 0.0, motion_.sample_s);
  std::erase_if(friction_elements_, [&](size_t e) { return std::ranges::count(off_, e) > 0; });
  dynamics_.Factor(0.0, now_.states);
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, now_.states);
  for (const size_t e : friction_elements_) {
    if (Rests(e, rows[e])) {
      start.stops.push_back(e);
    } else {
      phase.sign[e] = RateOf(rows[e], now_.states.V_WB) > 0.0 ? 1 : -1;
    }
  }
  dynamics_.SetPhase(std::move(phase));
  if (!start.stops.empty()) {
    if (RunSummary summary = Settle(start, 0.0); !summary.ok()) return summary;
  }
  return dynamics_.Accelerate(now_.time_s, &now_.states);
}

RunSummary FreeMotion::SwitchFriction(double to_s) {
  std::vector<size_t> off = SwitchedOff(motion_, now_.time_s, time_(to_s));
  if (off == off_) return RunSummary::Done();
  FrictionPhase phase = dynamics_.phase();
  FrictionPhase next{.sign = phase.sign, .held = {}, .prescribed = phase.prescribed};
  for (size_t k = 0; k < phase.held.size(); ++k) {
    if (std::ranges::count(off, phase.held[k]) > 0) continue;
    next.held.push_back(phase.held[k]);
    next.at.push_back(phase.at[k]);
  }
  FrictionEvent event;
  dynamics_.Factor(now_.time_s, now_.states);
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, now_.states);
  friction_elements_.clear();
  for (const size_t e : all_friction_) {
    if (std::ranges::count(off, e) > 0) {
      next.sign[e] = 0;
      continue;
    }
    friction_elements_.push_back(e);
    if (std::ranges::count(off_, e) == 0) continue;
    if (Rests(e, rows[e])) {
      event.stops.push_back(e);
    } else {
      next.sign[e] = RateOf(rows[e], now_.states.V_WB) > 0.0 ? 1 : -1;
    }
  }
  off_ = std::move(off);
  dynamics_.SetPhase(std::move(next));
  settled_here_ = 0;
  if (!event.stops.empty()) {
    if (RunSummary summary = Settle(event, 0.0); !summary.ok()) return summary;
  }
  return dynamics_.Accelerate(now_.time_s, &now_.states);
}

// Before a step: forces may have jumped, and what has just started may set others free.
RunSummary FreeMotion::CheckFriction() {
  if (friction_elements_.empty()) return RunSummary::Done();
  FollowDeadCentres();
  if (dynamics_.phase().held.empty()) return RunSummary::Done();
  for (;;) {
    BodyStates states = now_.states;
    if (RunSummary summary = dynamics_.Accelerate(now_.time_s, &states); !summary.ok()) {
      return summary;
    }
    const double load = LoadRatio(dynamics_.rest());
    if (load <= 1.0 + kExceeds) return RunSummary::Done();
    const size_t held = dynamics_.phase().held.front();
    if (std::isnan(load)) {
      return Contradiction(held, "and others share their load at rest in too many ways", kNan, "");
    }
    const FrictionEvent event{.after_s = 0.0, .starts = true};
    if (RunSummary summary = Settle(event, dt_); !summary.ok()) return summary;
    if (dynamics_.phase().held.empty()) return RunSummary::Done();
  }
}

RunSummary FreeMotion::AcceptWithFriction(const State& x, double t_s, double tried_s) {
  if (friction_elements_.empty()) return Accept(x, t_s);
  const State from = Pack(now_);
  const std::optional<FrictionEvent> event = FirstEvent(from, tried_s, x);
  if (!trouble_.ok()) return trouble_;
  if (!event) {
    settled_here_ = 0;
    std::ranges::fill(fresh_, 0);
    return Accept(x, t_s);
  }
  if (event->after_s > 0.0) {
    settled_here_ = 0;
    std::ranges::fill(fresh_, 0);
    const State at = StepFrom(from, event->after_s);
    if (!trouble_.ok()) return trouble_;
    if (RunSummary summary = Accept(at, now_.time_s + event->after_s); !summary.ok()) {
      return summary;
    }
  }
  return Settle(*event, tried_s);
}

std::optional<FreeMotion::FrictionEvent> FreeMotion::FirstEvent(const State& from, double h,
                                                                const State& to) {
  FrictionEvent first{.after_s = 2.0 * h, .starts = false};
  FindStops(from, h, to, &first);
  if (!dynamics_.phase().held.empty()) FindStart(from, h, to, &first);
  if (first.after_s > h) return {};
  return first;
}

// Elements whose rate leaves the direction in which they slide.
void FreeMotion::FindStops(const State& from, double h, const State& to, FrictionEvent* first) {
  BodyStates begin = now_.states, end = StatesOf(to);
  trouble_ = dynamics_.Accelerate(now_.time_s, &begin);
  if (trouble_.ok()) trouble_ = dynamics_.Accelerate(time_(now_.time_s + h), &end);
  if (!trouble_.ok()) return;
  const std::vector<ScalarRow> at_begin = ElementRows(mechanism_, begin),
                               at_end = ElementRows(mechanism_, end);
  for (const size_t e : friction_elements_) {
    const double s = dynamics_.phase().sign[e];
    if (s == 0.0) continue;
    const auto rate = [&](double after_s) {
      const auto k = static_cast<Eigen::Index>(e);
      return s * ElementRates(StatesOf(StepFrom(from, after_s)))[k];
    };
    const double v0 = s * RateOf(at_begin[e], begin.V_WB), v1 = s * RateOf(at_end[e], end.V_WB);
    const double a0 = s * (RateOf(at_begin[e], begin.A_WB) + at_begin[e].bias);
    const double a1 = s * (RateOf(at_end[e], end.A_WB) + at_end[e].bias);
    // A time at which it is beyond zero …
    double beyond = v1 < 0.0 ? h : -1.0;
    for (int i = 1; i < kRateLooks && beyond < 0.0; ++i) {
      const double t = h * i / kRateLooks;
      if (Cubic(h, t, v0, a0, v1, a1) < 0.0 && rate(t) < 0.0) beyond = t;
    }
    if (beyond < 0.0) continue;
    // … and one at which it is not there yet.
    double before = v0 > 0.0 && fresh_[e] == 0 ? 0.0 : -1.0, t = beyond;
    for (int i = 0; i < kMostHalvings && before < 0.0; ++i) {
      t *= 0.5;
      if (rate(t) > 0.0) before = t;
    }
    const double at = before < 0.0 ? 0.0 : Root(rate, before, beyond);
    if (at > first->after_s) continue;
    if (at < first->after_s) *first = {.after_s = at, .starts = false};
    first->stops.push_back(e);
  }
}

// The load of the held elements exceeds what their friction takes.
void FreeMotion::FindStart(const State& from, double h, const State& to, FrictionEvent* first) {
  const auto excess = [&](double after_s) {
    BodyStates states = StatesOf(StepFrom(from, after_s));
    if (!trouble_.ok()) return kNan;
    trouble_ = dynamics_.Accelerate(time_(now_.time_s + after_s), &states);
    return LoadRatio(dynamics_.rest()) - 1.0;
  };
  const double end = std::min(h, first->after_s);
  // Looks on the cubic through both ends of the step.
  State from_rates, to_rates;
  Rates(from, &from_rates, now_.time_s);
  Rates(to, &to_rates, now_.time_s + h);
  const auto as_vector = [](const State& x) {
    return VecX(Eigen::Map<const VecX>(x.data(), static_cast<Eigen::Index>(x.size())));
  };
  const Hermite way({0.0, h}, {as_vector(from), as_vector(to)},
                    {as_vector(from_rates), as_vector(to_rates)});
  const auto look = [&](double after_s) {
    VecX x, rates;
    way.Evaluate(after_s, &x, &rates);
    BodyStates states = StatesOf({x.begin(), x.end()});
    trouble_ = dynamics_.Accelerate(time_(now_.time_s + after_s), &states);
    return trouble_.ok() ? LoadRatio(dynamics_.rest()) - 1.0 : kNan;
  };
  std::array<double, kLoadLooks + 1> looks{};
  double until = -1.0;
  for (size_t i = 0; i < looks.size() && until < 0.0 && trouble_.ok(); ++i) {
    const double t = end * static_cast<double>(i) / kLoadLooks;
    looks.at(i) = look(t);
    if (looks.at(i) > kExceeds && (i == 0 || excess(t) > 0.0)) until = t;
  }
  // A peak between two looks, if it may be high enough.
  const auto peak = static_cast<size_t>(std::ranges::max_element(looks) - looks.begin());
  if (until < 0.0 && peak > 0 && peak < kLoadLooks && trouble_.ok()) {
    const double least = std::min(looks.at(peak - 1), looks.at(peak + 1));
    if (2.0 * looks.at(peak) - least > 0.0) {
      const auto [t, value] = boost::math::tools::brent_find_minima(
          [&](double after_s) { return -look(after_s); },
          end * static_cast<double>(peak - 1) / kLoadLooks,
          end * static_cast<double>(peak + 1) / kLoadLooks, 26);
      if (-value > kExceeds && excess(t) > 0.0) until = t;
    }
  }
  if (!trouble_.ok() || until < 0.0) return;
  const double at = until == 0.0 || looks[0] >= 0.0 ? 0.0 : Root(excess, 0.0, until);
  if (at < first->after_s) *first = {.after_s = at, .starts = true};
}

// All that is at rest: held, just stopped, or too slow to decide; not what has just started.
FrictionPhase FreeMotion::RestingPhase(const FrictionEvent& event) {
  const FrictionPhase& phase = dynamics_.phase();
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, now_.states);
  dynamics_.Factor(now_.time_s, now_.states);
  FrictionPhase resting{.sign = phase.sign, .held = {}, .prescribed = phase.prescribed};
  for (const size_t e : friction_elements_) {
    const auto held = std::ranges::find(phase.held, e);
    const bool stopped = std::ranges::find(event.stops, e) != event.stops.end();
    const bool rests = phase.sign[e] == 0 || stopped || (fresh_[e] == 0 && Rests(e, rows[e]));
    if (!rests) continue;
    resting.held.push_back(e);
    resting.at.push_back(held == phase.held.end()
                             ? rows[e].value
                             : phase.at[static_cast<size_t>(held - phase.held.begin())]);
    resting.sign[e] = 0;
  }
  return resting;
}

// What rests at a dead centre is not held: it slides on as loops have it, whatever its friction.
// The acceleration gives the direction; where the DOFs rest as well, FollowDeadCentres() does.
RunSummary FreeMotion::LeaveDeadCentres(FrictionPhase* resting) {
  BodyStates at = now_.states;
  if (RunSummary summary = dynamics_.Accelerate(now_.time_s, &at); !summary.ok()) return summary;
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, at);
  std::vector<size_t> held;
  std::vector<double> values;
  for (size_t k = 0; k < resting->held.size(); ++k) {
    const size_t e = resting->held[k];
    if (!AtDeadCentre(rows[e])) {
      held.push_back(e);
      values.push_back(resting->at[k]);
      continue;
    }
    const double acceleration = RateOf(rows[e], at.A_WB) + rows[e].bias;
    const double size = MostOf(rows[e], at.A_WB, dynamics_.length()) + std::abs(rows[e].bias);
    resting->sign[e] = SignOf(acceleration, kTurns * size);
    fresh_[e] = resting->sign[e] != 0 ? 1 : 0;
  }
  resting->held = std::move(held);
  resting->at = std::move(values);
  return RunSummary::Done();
}

// What stands at a dead centre slides as the DOFs take it along in the step ahead, if they do:
// by the shortest part of it in which the rate shows.
void FreeMotion::FollowDeadCentres() {
  FrictionPhase phase = dynamics_.phase();
  std::vector<size_t> open;
  for (const size_t e : friction_elements_) {
    if (phase.sign[e] == 0 && std::ranges::count(phase.held, e) == 0) open.push_back(e);
  }
  if (open.empty()) return;
  const State from = Pack(now_);
  const double step_s = std::min(dt_, largest_step_s_);
  const auto signs_after = [&](double after_s) {
    trouble_ = RunSummary::Done();
    const BodyStates ahead = StatesOf(StepFrom(from, after_s));
    std::vector<int> sign(mechanism_.elements.size(), 0);
    if (!std::exchange(trouble_, RunSummary::Done()).ok()) return sign;
    const std::vector<ScalarRow> rows = ElementRows(mechanism_, ahead);
    for (const size_t e : open) {
      sign[e] = SignOf(RateOf(rows[e], ahead.V_WB),
                       kTurns * MostOf(rows[e], ahead.V_WB, dynamics_.length()));
    }
    return sign;
  };
  const std::vector<int> in_the_end = signs_after(step_s);
  std::erase_if(open, [&](size_t e) { return in_the_end[e] == 0; });
  for (double share = kAhead; share < 0.5 && !open.empty(); share *= 10.0) {
    const std::vector<int> sign = signs_after(share * step_s);
    for (const size_t e : open) phase.sign[e] = sign[e];
    std::erase_if(open, [&](size_t e) { return sign[e] != 0; });
  }
  for (const size_t e : open) phase.sign[e] = in_the_end[e];
  dynamics_.SetPhase(std::move(phase));
}

// Signs of what starts, per held element, from the load at these states.
std::vector<int> FreeMotion::Starting(double t_s, const BodyStates& states, RunSummary* trouble) {
  BodyStates at = states;
  std::vector<int> sign;
  *trouble = dynamics_.Accelerate(t_s, &at);
  if (!trouble->ok()) return sign;
  if (DecideRest(dynamics_.rest(), &sign)) return sign;
  *trouble = Contradiction(dynamics_.phase().held.front(),
                           "neither sticks nor slides in one direction (with what rests beside it)",
                           LoadRatio(dynamics_.rest()), "of breakaway");
  return sign;
}

// Whether all that stops slides on the other way at once: then it does, as the way on is unique.
// What held it in between would decide by the loads of another motion.
bool FreeMotion::PassesThrough(const FrictionPhase& resting, const std::vector<size_t>& stopping) {
  const FrictionPhase before = dynamics_.phase();
  FrictionPhase after{.sign = resting.sign, .held = {}, .prescribed = resting.prescribed};
  for (size_t k = 0; k < resting.held.size(); ++k) {
    const size_t e = resting.held[k];
    if (std::ranges::count(stopping, e) > 0) {
      if (before.sign[e] == 0) return false;
      after.sign[e] = -before.sign[e];
    } else {
      after.held.push_back(e);
      after.at.push_back(resting.at[k]);
    }
  }
  dynamics_.SetPhase(after);
  BodyStates at = now_.states;
  bool passes = dynamics_.Accelerate(now_.time_s, &at).ok();
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, at);
  for (const size_t e : stopping) {
    const double acceleration = RateOf(rows[e], at.A_WB) + rows[e].bias;
    const double size = std::abs(RateOf(rows[e], at.A_WB)) + std::abs(rows[e].bias);
    passes = passes && after.sign[e] * acceleration > kTurns * size;
  }
  if (!passes) dynamics_.SetPhase(before);
  for (const size_t e : stopping) fresh_[e] = passes ? 1 : fresh_[e];
  return passes;
}

RunSummary FreeMotion::Settle(const FrictionEvent& event, double h) {
  FrictionPhase next = RestingPhase(event);
  if (++settled_here_ > 4 + 2 * static_cast<int>(friction_elements_.size())) {
    return Contradiction(next.held.empty() ? friction_elements_.front() : next.held.front(),
                         "stops and starts again and again", settled_here_, "times");
  }
  if (RunSummary summary = LeaveDeadCentres(&next); !summary.ok()) return summary;
  std::vector<size_t> stopping = next.held;
  std::erase_if(stopping, [held = dynamics_.phase().held](size_t e) {
    return std::ranges::count(held, e) > 0;
  });
  const bool alone = !event.starts && (stopping.empty() || dynamics_.has_load_friction());
  if (!alone || !PassesThrough(next, stopping)) {
    if (RunSummary summary = DecideResting(next, event.starts, h); !summary.ok()) return summary;
  }
  FollowDeadCentres();
  return RunSummary::Done();
}

// Who of what rests sticks, and who starts which way.
RunSummary FreeMotion::DecideResting(const FrictionPhase& next, bool starts, double h) {
  // What starts does so by the load that it would have a little later.
  BodyStates ahead = now_.states;
  double ahead_s = now_.time_s;
  if (starts && h > 0.0) {
    ahead_s += kAhead * h;
    trouble_ = RunSummary::Done();
    ahead = StatesOf(StepFrom(Pack(now_), kAhead * h));
    if (!trouble_.ok()) return trouble_;
  }
  dynamics_.SetPhase(next);
  RunSummary trouble;
  std::vector<int> sign = Starting(time_(ahead_s), ahead, &trouble);
  if (!trouble.ok()) return trouble;
  if (starts && std::ranges::all_of(sign, [](int s) { return s == 0; })) {
    VecX direction = VecX::Zero(static_cast<Eigen::Index>(sign.size()));
    (void)LoadRatio(dynamics_.rest(), &direction);
    const double least = 1e-6 * direction.cwiseAbs().maxCoeff();
    for (size_t k = 0; k < sign.size(); ++k) {
      const double rate = direction[static_cast<Eigen::Index>(k)];
      if (std::abs(rate) > least) sign[k] = rate > 0.0 ? 1 : -1;
    }
  }
  FrictionPhase phase{.sign = next.sign, .held = {}, .prescribed = next.prescribed};
  for (size_t k = 0; k < sign.size(); ++k) {
    const size_t e = next.held[k];
    phase.sign[e] = sign[k];
    fresh_[e] = sign[k] != 0 ? 1 : 0;
    if (sign[k] != 0) continue;
    phase.held.push_back(e);
    phase.at.push_back(next.at[k]);
  }
  const bool sticks = !phase.held.empty();
  dynamics_.SetPhase(std::move(phase));
  // Only what sticks is brought to rest to round-off.
  return sticks ? dynamics_.Project(now_.time_s, &now_.states) : RunSummary::Done();
}

}  // namespace mbv::internal
