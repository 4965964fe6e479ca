#include "simulation/stick_slip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "simulation/element_forces.h"

namespace mbv::simulation {
namespace {

// A held row accelerates by R times its force, 1e-9 of what its breakaway force would do to its
// coordinate alone; above this share it starts.
constexpr double kStarts = 1e-6;
// At an event, other rates below this share of the rest rate have come to rest as well: joints of
// one loop.
constexpr double kStopped = 1e-3;
// Loops turn a joint that has stopped into rest of another one where its pivot is above this share
// of the largest. At a dead point, where a guide stops and the crank runs on, it is round-off; what
// the loops miss is divided by it.
constexpr double kDetermined = 1e-4;
constexpr int kHalvings = 40, kPassesToRoot = 80;
// Where a held coordinate starts is the zero of its acceleration, extrapolated from this share of
// the step behind it.
constexpr double kBehind = 1e-3;
constexpr int kMostRounds = 40, kMostEvents = 200;  // at one node, in one step

}  // namespace

StickSlip::StickSlip(Session* session, Integrator* integrator, CommandAt command)
    : s_(*session), integrator_(*integrator), command_(std::move(command)) {
  const std::vector<ForceElement>& elements = s_.engine.mechanism->elements;
  for (size_t e = 0; e < elements.size(); ++e) {
    if (Rubs(elements[e]) && !s_.engine.elements[e].led) rubbing_.push_back(e);
  }
  sliding_.assign(elements.size(), 0);
  fresh_.assign(elements.size(), 0);
}

void StickSlip::FindSliding() {
  for (const size_t e : rubbing_) {
    const double rate = ElementMotionOf(s_.system, e).rate;
    const bool rests = std::abs(rate) <= kStopped * s_.engine.elements[e].rest_rate;
    sliding_[e] = rests ? 0 : rate > 0.0 ? 1 : -1;
  }
  s_.system.SetSliding(sliding_);
}

RunSummary StickSlip::Begin() { return LetGo(0.0); }

// The acceleration that counts as one.
double StickSlip::Moving(size_t element) const {
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const std::vector<size_t>& of = s_.engine.frictions[static_cast<size_t>(row)].elements;
    if (std::ranges::find(of, element) == of.end()) continue;
    return kStarts * s_.system.HeldLoss(row) * s_.data->efc_diagApprox[s_.system.rows() + row];
  }
  return kNan;
}

bool StickSlip::Stopped(size_t element) const {
  return sliding_[element] * ElementMotionOf(s_.system, element).rate < 0.0;
}

int StickSlip::Started(size_t element) const {
  if (sliding_[element] != 0) return 0;
  const double acceleration = ElementMotionOf(s_.system, element).acceleration;
  if (std::abs(acceleration) <= Moving(element)) return 0;
  return acceleration > 0.0 ? 1 : -1;
}

bool StickSlip::Ended() const {
  return std::ranges::any_of(rubbing_, [this](size_t e) { return Stopped(e) || Started(e) != 0; });
}

RunSummary StickSlip::Go(double from_s, double h, bool multistep) {
  Commanded middle, end;
  if (RunSummary summary = command_(from_s + h, &end); !summary.ok()) return summary;
  if (multistep) {
    integrator_.MultiStep(h, end, from_s + h);
    return RunSummary::Done();
  }
  if (RunSummary summary = command_(from_s + 0.5 * h, &middle); !summary.ok()) return summary;
  integrator_.RungeKutta(h, middle, end, from_s);
  return RunSummary::Done();
}

// The present node with other signs.
RunSummary StickSlip::Jump(double t_s) {
  s_.system.SetSliding(sliding_);
  Commanded at;
  if (RunSummary summary = command_(t_s, &at); !summary.ok()) return summary;
  integrator_.EvaluateAgain(at, t_s);
  return RunSummary::Done();
}

// What MuJoCo does not hold slides from here on; that may set others free.
RunSummary StickSlip::LetGo(double t_s) {
  for (int pass = 0; pass < kMostRounds; ++pass) {
    bool changed = false;
    for (const size_t e : rubbing_) {
      const int sign = Started(e);
      if (sign == 0) continue;
      sliding_[e] = sign;
      fresh_[e] = 1;
      changed = true;
    }
    if (!changed) return RunSummary::Done();
    if (RunSummary summary = Jump(t_s); !summary.ok()) return summary;
  }
  return {.stop = Stop::kNoConvergence,
          .message = "friction starts and stops again and again",
          .time_s = t_s,
          .where = {},
          .unit = {}};
}

// (1)
RunSummary StickSlip::FindRates(const Event& event, double t_s) {
  Commanded at;
  if (RunSummary summary = command_(t_s, &at); !summary.ok()) return summary;
  const ConstraintSystem& system = s_.system;
  const auto rests = [&](size_t e) {
    return sliding_[e] == 0 || std::ranges::find(event.stops, e) != event.stops.end();
  };
  const Eigen::Index rows = system.rows(), resting = std::ranges::count_if(rubbing_, rests);
  const Eigen::Map<const VecX> v(s_.data->qvel, system.nv());
  MatX S(rows + resting, system.nv());
  VecX missed(rows + resting);
  S.topRows(rows) = system.ScaledJ();
  missed.head(rows) = system.J() * v;
  system.AddGuided(-1.0, at.motion.velocity, &missed);
  missed.head(rows) = missed.head(rows).cwiseQuotient(system.row_unit());
  Eigen::Index row = rows;
  for (const size_t e : rubbing_) {
    if (!rests(e)) continue;
    const VecX G = ElementGradient(system, e).cwiseProduct(system.dof_unit());
    const double unit = std::max(G.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min());
    S.row(row) = G.transpose() / unit;
    missed[row++] = ElementMotionOf(system, e).rate / unit;
  }
  Eigen::CompleteOrthogonalDecomposition<MatX> factors;
  factors.setThreshold(kDetermined);
  factors.compute(S);
  const VecX error = factors.solve(missed).cwiseProduct(system.dof_unit());
  rates_.resize(rubbing_.size());
  for (size_t k = 0; k < rubbing_.size(); ++k) {
    const size_t e = rubbing_[k];
    rates_[k] = ElementMotionOf(system, e).rate - ElementGradient(system, e).dot(error);
  }
  return RunSummary::Done();
}

// What comes to rest with the event, and what starts there.
RunSummary StickSlip::Apply(const Event& event, double t_s) {
  if (!event.stops.empty()) {
    if (RunSummary summary = FindRates(event, t_s); !summary.ok()) return summary;
    for (size_t k = 0; k < rubbing_.size(); ++k) {
      const size_t e = rubbing_[k];
      const bool stops = std::ranges::find(event.stops, e) != event.stops.end();
      const bool slow = std::abs(rates_[k]) <= kStopped * s_.engine.elements[e].rest_rate;
      if (stops || (slow && fresh_[e] == 0)) sliding_[e] = 0;
    }
  }
  for (const auto& [e, sign] : event.starts) {
    sliding_[e] = sign;
    fresh_[e] = 1;
  }
  return RunSummary::Done();
}

double StickSlip::RateAfter(const Integrator::Node& node, size_t element, double from_s, double h) {
  integrator_.Restore(node);
  if (RunSummary summary = Go(from_s, h, false); !summary.ok()) trouble_ = summary;
  return sliding_[element] * ElementMotionOf(s_.system, element).rate;
}

// By regula falsi with halved ends (Illinois), between a time before and one beyond.
double StickSlip::StopTime(const Integrator::Node& node, size_t element, double from_s, double h) {
  const auto rate = [&](double t) { return RateAfter(node, element, from_s, t); };
  double beyond = h, at_beyond = rate(h), before = h, at_before = -1.0;
  for (int i = 0; i < kHalvings && at_before <= 0.0; ++i) {
    before *= 0.5;
    at_before = rate(before);
  }
  if (at_before <= 0.0) return 0.0;
  int side = 0;
  for (int i = 0; i < kPassesToRoot && beyond - before > 4.0 * kEps * h; ++i) {
    const double t = (at_beyond * before - at_before * beyond) / (at_beyond - at_before);
    const double at = rate(t);
    if (at == 0.0) return t;
    if (at < 0.0) {
      beyond = t;
      at_beyond = at;
      if (side == -1) at_before *= 0.5;
      side = -1;
    } else {
      before = t;
      at_before = at;
      if (side == 1) at_beyond *= 0.5;
      side = 1;
    }
  }
  return 0.5 * (before + beyond);
}

double StickSlip::StartTime(const Integrator::Node& node, size_t element, double from_s, double h,
                            int* sign) {
  const auto acceleration = [&](double t) {
    integrator_.Restore(node);
    if (RunSummary summary = Go(from_s, t, false); !summary.ok()) trouble_ = summary;
    *sign = Started(element);
    return ElementMotionOf(s_.system, element).acceleration;
  };
  double before = 0.0, beyond = h;
  for (int i = 0; i < kHalvings; ++i) {
    const double t = 0.5 * (before + beyond);
    (void)acceleration(t);
    (*sign == 0 ? before : beyond) = t;
  }
  const double t_1 = beyond + kBehind * h, t_2 = beyond + 2.0 * kBehind * h;
  const double a_1 = acceleration(t_1), a_2 = acceleration(t_2);
  const double t = t_1 - a_1 * (t_2 - t_1) / (a_2 - a_1);
  if (t <= -kBehind * h || t >= beyond) return beyond;  // it jumped
  return std::max(t, 0.0);
}

// The first event of a step that was tried.
RunSummary StickSlip::Find(const Integrator::Node& node, double from_s, double h, Event* event) {
  std::vector<size_t> stopped, started;
  for (const size_t e : rubbing_) {
    if (Stopped(e)) stopped.push_back(e);
    if (Started(e) != 0) started.push_back(e);
  }
  event->after_s = 2.0 * h;
  trouble_ = RunSummary::Done();
  for (const size_t e : stopped) {
    const double at = StopTime(node, e, from_s, h);
    if (at < event->after_s) *event = {.after_s = at, .stops = {e}, .starts = {}};
  }
  for (const size_t e : started) {
    int sign = 0;
    const double at = StartTime(node, e, from_s, h, &sign);
    if (at > event->after_s) continue;
    if (at < event->after_s) *event = {.after_s = at, .stops = {}, .starts = {}};
    if (sign != 0) event->starts.emplace_back(e, sign);
  }
  return trouble_;
}

RunSummary StickSlip::Advance(const Step& step) {
  double from = step.from_s;
  for (int events = 0; events < kMostEvents; ++events) {
    const double h = step.to_s - from;
    const bool whole = from == step.from_s;
    const bool multistep = whole && std::min(step.uniform, uniform_) == 4;
    const Integrator::Node node = integrator_.Save();
    if (RunSummary summary = Go(from, h, multistep); !summary.ok()) return summary;
    if (!integrator_.healthy() || !Ended()) {
      s_.work.Step(h, multistep, s_.WorkRates());
      uniform_ = whole ? std::min(uniform_ + 1, 4) : 1;
      std::ranges::fill(fresh_, 0);
      return RunSummary::Done();
    }
    Event event;
    if (RunSummary summary = Find(node, from, h, &event); !summary.ok()) return summary;
    integrator_.Restore(node);
    if (event.after_s > 0.0) {
      if (RunSummary summary = Go(from, event.after_s, false); !summary.ok()) return summary;
      s_.work.Step(event.after_s, false, s_.WorkRates());
      std::ranges::fill(fresh_, 0);
      from += event.after_s;
    } else if (RunSummary summary = Jump(from); !summary.ok()) {
      return summary;
    }
    s_.run->trace.breaks_s.push_back(from);
    if (RunSummary summary = Apply(event, from); !summary.ok()) return summary;
    if (RunSummary summary = Jump(from); !summary.ok()) return summary;
    if (RunSummary summary = LetGo(from); !summary.ok()) return summary;
    s_.work.Jump(s_.WorkRates());
    uniform_ = 0;
  }
  return {.stop = Stop::kNoConvergence,
          .message = fmt::format("friction starts and stops again and again at t = {:.6g} s", from),
          .time_s = from,
          .where = {},
          .unit = {}};
}

}  // namespace mbv::simulation
