// Free motion over singular poses: where they lie, and the bridge on which a motion passes one.
#include <cmath>
#include <limits>

#include "mechanism/body_states.h"
#include "reference/closure_solver.h"
#include "reference/force_solver.h"
#include "reference/free_motion.h"

namespace mbv::internal {
namespace {

// A singular pose counts as passed if the search between the nodes brings the pivot below this
// share of the largest of the run.
constexpr double kPassed = 1e-3;
// Below this share a bridge is tried: there round-off in the states (1e-13) is still divided by
// 1e-2 only.
constexpr double kBridge = 0.02;
// A bridge rests on this many nodes, each at least this many bridge lengths from the next: the
// polynomial of degree 9 then carries on their round-off 1e3 times.
constexpr size_t kPillars = 5;
constexpr double kSpacing = 1.0;
// A bridge whose end must be moved farther onto the loops [rad, characteristic lengths], or whose
// energy and work differ by a larger share, does not follow the motion.
constexpr double kMoved = 1e-7, kUnbalanced = 1e-8;

}  // namespace

// Near the singular pose the accelerations are the polynomial's, too.
RunSummary FreeMotion::SampleBridge(double t_s) {
  VecX x, rates;
  bridge_->way.Evaluate(t_s, &x, &rates);
  sampled_ = now_.states;  // their angles' turns
  Unpack({x.begin(), x.end()}, &sampled_, &sampled_work_);
  const double* in = rates.data();
  for (size_t b = 1; b < sampled_.A_WB.size(); ++b, in += kPerBody) {
    sampled_.A_WB[b] = Eigen::Map<const Vec6>(in + 7);
    sampled_.A_WB[b].tail<3>() *= dynamics_.length();
  }
  return dynamics_.Project(t_s, &sampled_);
}

double FreeMotion::TimeToSingular() const {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (nodes_.empty() || !(nodes_.back().pivot > now_.pivot)) return kNever;
  const Node& before = nodes_.back();
  return now_.pivot * (now_.time_s - before.time_s) / (before.pivot - now_.pivot);
}

// The polynomial through now_ and four nodes before it, or nothing if they do not reach back far
// enough.
std::optional<Hermite> FreeMotion::WayOn(double gap_s) {
  std::vector<double> times;
  std::vector<VecX> values, rates;
  State previous;
  auto next = nodes_.rbegin();
  for (size_t k = 0; k < kPillars; ++k) {
    const Node* nearest = &now_;
    if (k > 0) {
      const double latest = times.back() - kSpacing * gap_s;
      while (next != nodes_.rend() && next->time_s > latest) ++next;
      if (next == nodes_.rend()) return {};
      nearest = &*next;
    }
    State x = Pack(*nearest), x_rate;
    // Quaternions up to sign: the one next to the last pillar's.
    for (size_t at = 3; k > 0 && at + 10 <= x.size() && at / kPerBody + 1 < now_.states.X_WB.size();
         at += kPerBody) {
      Eigen::Map<Eigen::Vector4d> q(x.data() + at);
      if (q.dot(Eigen::Map<Eigen::Vector4d>(previous.data() + at)) < 0.0) q = -q;
    }
    trouble_ = RunSummary::Done();
    Rates(x, &x_rate, nearest->time_s);
    if (!trouble_.ok()) return {};
    times.push_back(nearest->time_s);
    values.push_back(Eigen::Map<const VecX>(x.data(), static_cast<Eigen::Index>(x.size())));
    rates.push_back(
        Eigen::Map<const VecX>(x_rate.data(), static_cast<Eigen::Index>(x_rate.size())));
    previous = std::move(x);
  }
  return Hermite(times, values, rates);
}

bool FreeMotion::Land(const Hermite& way, double at_s, Node* node) {
  VecX x, rates;
  way.Evaluate(at_s, &x, &rates);
  *node = now_;
  node->time_s = at_s;
  Unpack({x.begin(), x.end()}, &node->states, &node->work);
  double moved = kNan;
  if (!dynamics_.Project(at_s, &node->states, &moved).ok()) return false;
  node->pivot = dynamics_.pivot();
  const Energies from = EnergyOf(mechanism_, now_.states);
  const Energies to = EnergyOf(mechanism_, node->states);
  const double change = to.kinetic + to.gravity + to.springs - from.kinetic - from.gravity -
                        from.springs - (node->work - now_.work).sum();
  return moved < kMoved && std::abs(change) <= kUnbalanced * std::max(from.kinetic, to.kinetic);
}

void FreeMotion::TryBridge() {
  if (!rubbing_.empty()) return;  // what slides could stop on it
  if (!(now_.pivot < kBridge * largest_pivot_)) return;
  const double half = TimeToSingular(), landing = now_.time_s + 2.0 * half;
  if (!std::isfinite(landing)) return;
  for (const double at : breaks_) {
    if (at > now_.time_s && at < landing) return;
  }
  std::optional<Hermite> way = WayOn(2.0 * half);
  trouble_ = RunSummary::Done();
  if (!way) return;
  Node end;
  if (!Land(*way, landing, &end)) return;
  const auto states_at = [&](double t_s, BodyStates* states) {
    VecX x, rates;
    way->Evaluate(t_s, &x, &rates);
    *states = now_.states;
    Unpack({x.begin(), x.end()}, states, nullptr);
  };
  passages_.push_back(Closest(now_.time_s, landing, states_at));
  bridge_ = Bridge{now_.time_s, landing, *std::move(way)};
  now_ = std::move(end);
  nodes_.clear();
}

// Looks for a singular pose around the last node where its pivot is a local minimum.
void FreeMotion::Watch() {
  if (nodes_.size() < 2) return;
  const Node &last = nodes_.back(), &before = nodes_[nodes_.size() - 2];
  if (!(last.pivot < before.pivot && last.pivot <= now_.pivot)) return;
  if (last.pivot > 0.5 * largest_pivot_) return;
  const auto states_at = [&](double t_s, BodyStates* states) {
    const double dt = t_s - last.time_s;
    *states = last.states;
    MoveBodies(dt * Stack(states->V_WB) + 0.5 * dt * dt * Stack(states->A_WB), states);
  };
  const SingularPassage passage = Closest(before.time_s, now_.time_s, states_at);
  if (passage.pivot < kNear * largest_pivot_) passages_.push_back(passage);
}

// Golden-section search for the smallest pivot. It falls and rises like |t|, so that the time can
// be found to round-off; Boost's minimiser stops at its root, where a parabola would be flat.
template <typename StatesAt>
SingularPassage FreeMotion::Closest(double first_s, double last_s, const StatesAt& states_at) {
  BodyStates states;
  const auto pivot_at = [&](double t_s) {
    states_at(t_s, &states);
    dynamics_.Factor(t_s, states);
    return dynamics_.pivot();
  };
  constexpr double kGolden = 0.6180339887498949;
  double a = first_s, b = last_s;
  double c = b - kGolden * (b - a), d = a + kGolden * (b - a);
  double at_c = pivot_at(c), at_d = pivot_at(d);
  for (int i = 0; i < 40; ++i) {
    if (at_c < at_d) {
      b = d;
      d = c;
      at_d = at_c;
      c = b - kGolden * (b - a);
      at_c = pivot_at(c);
    } else {
      a = c;
      c = d;
      at_c = at_d;
      d = a + kGolden * (b - a);
      at_d = pivot_at(d);
    }
  }
  const double t_s = 0.5 * (a + b);
  SingularPassage passage{.time_s = t_s, .pivot = pivot_at(t_s), .joint = {}};
  passage.joint = dynamics_.SoftJoint(states);
  return passage;
}

std::vector<SingularPassage> FreeMotion::Passages() const {
  std::vector<SingularPassage> passages = passages_;
  for (SingularPassage& passage : passages) {
    passage.pivot /= largest_pivot_;
    passage.passed = passage.pivot < kPassed;
  }
  return passages;
}

}  // namespace mbv::internal
