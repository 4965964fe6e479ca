#include "reference/free_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/numeric/odeint.hpp>
#include <cmath>

#include "mechanism/body_states.h"
#include "mechanism/break_times.h"
#include "reference/closure_solver.h"
#include "reference/spring_mode.h"
#include "reference/square_system.h"

namespace mbv::internal {
namespace {

namespace odeint = boost::numeric::odeint;

constexpr double kSmallestStepShare = 1e-10;  // of the duration
// Below this share of the largest pivot steps go half the way to the singular pose at most.
constexpr double kApproach = 0.2;
constexpr size_t kMostNodes = 600;
constexpr long kTold = 64;  // steps from one word about the progress to the next
// Steps from one look ahead to the next; and how far above what is left the estimate must be, which
// is good to some percent.
constexpr long kLook = 1000;
constexpr double kSurely = 1.1;

}  // namespace

struct FreeMotion::Stepper {
  using Fehlberg = odeint::runge_kutta_fehlberg78<State>;
  odeint::controlled_runge_kutta<Fehlberg> controlled;
  Fehlberg plain = {};  ///< for steps of a given length

  explicit Stepper(double tolerance)
      : controlled(
            odeint::default_error_checker<double, odeint::range_algebra,
                                          odeint::default_operations>(tolerance, tolerance)) {}
};

FreeMotion::State FreeMotion::StepFrom(const State& from, double h) {
  if (h == 0.0) return from;
  const auto rates = [this](const State& at, State& out, double t_s) { Rates(at, &out, t_s); };
  State to(from.size());
  stepper_->plain.do_step(rates, from, now_.time_s, to, h);
  return to;
}

FreeMotion::FreeMotion(const Mechanism& mechanism, const Motion& motion, double tolerance,
                       double largest_step_s, Effort effort)
    : mechanism_(mechanism),
      duration_s_(motion.duration_s),
      largest_step_s_(largest_step_s),
      effort_(std::move(effort)),
      dynamics_(mechanism, motion),
      stepper_(std::make_unique<Stepper>(tolerance)),
      breaks_(BreakTimes(motion)),
      dt_(std::min({motion.sample_s, largest_step_s, 1e-3})),
      tolerance_(tolerance),
      fresh_(mechanism.elements.size(), 0) {
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    if (Rubs(mechanism.elements[e])) rubbing_.push_back(e);
  }
  now_.states.Resize(mechanism.bodies.size());
  work_states_ = sampled_ = now_.states;
  double mass = 0.0;
  for (const Body& body : mechanism.bodies) mass += body.mass;
  if (mass > 0.0) work_unit_ = mass * dynamics_.length() * dynamics_.length();
}

FreeMotion::~FreeMotion() = default;

FreeMotion::State FreeMotion::Pack(const Node& node) const {
  State x(kPerBody * (node.states.X_WB.size() - 1));
  double* out = x.data();
  for (size_t b = 1; b < node.states.X_WB.size(); ++b, out += kPerBody) {
    Eigen::Map<Vec3>{out} = (node.states.X_WB[b].translation() - start_W_[b]) / dynamics_.length();
    const Eigen::Quaterniond q(Mat3(node.states.X_WB[b].linear()));
    Eigen::Map<Eigen::Vector4d>(out + 3) << q.w(), q.x(), q.y(), q.z();
    Eigen::Map<Vec6>{out + 7} = node.states.V_WB[b];
    Eigen::Map<Vec3>(out + 10) /= dynamics_.length();
  }
  for (const double work : node.work) x.push_back(work / work_unit_);
  return x;
}

void FreeMotion::Unpack(const State& x, BodyStates* states, VecX* work) const {
  const double* in = x.data();
  for (size_t b = 1; b < states->X_WB.size(); ++b, in += kPerBody) {
    states->X_WB[b].translation() = start_W_[b] + dynamics_.length() * Eigen::Map<const Vec3>(in);
    const Eigen::Quaterniond q(in[3], in[4], in[5], in[6]);
    states->X_WB[b].linear() = q.normalized().toRotationMatrix();
    states->V_WB[b] = Eigen::Map<const Vec6>(in + 7);
    states->V_WB[b].tail<3>() *= dynamics_.length();
  }
  if (work != nullptr) *work = work_unit_ * Eigen::Map<const VecX>(in, dynamics_.works());
}

RunSummary FreeMotion::Start(const BodyStates& states) {
  now_.states = states;
  start_W_.clear();
  for (const Pose& X_WB : states.X_WB) start_W_.push_back(X_WB.translation());
  now_.work.setZero(dynamics_.works());
  now_.time_s = 0.0;
  nodes_.clear();
  if (RunSummary summary = dynamics_.Project(0.0, &now_.states); !summary.ok()) return summary;
  RunSummary summary = dynamics_.Accelerate(0.0, &now_.states);
  now_.pivot = largest_pivot_ = dynamics_.pivot();
  if (!summary.ok() || rubbing_.empty()) return summary;
  return BeginFriction();
}

void FreeMotion::Rates(const State& x, State* rates, double t_s) {
  rates->assign(x.size(), 0.0);
  if (!trouble_.ok()) return;
  ++evaluations_;
  work_states_.coupled = now_.states.coupled;
  work_states_.turns = now_.states.turns;
  Unpack(x, &work_states_, nullptr);
  trouble_ = Accelerate(t_s, &work_states_);
  if (!trouble_.ok()) return;
  double* out = rates->data();
  const double* in = x.data();
  for (size_t b = 1; b < work_states_.X_WB.size(); ++b, out += kPerBody, in += kPerBody) {
    Eigen::Map<Vec3>{out} = work_states_.V_WB[b].tail<3>() / dynamics_.length();
    const Eigen::Quaterniond q(in[3], in[4], in[5], in[6]);
    const Vec3 w = work_states_.V_WB[b].head<3>();
    const Eigen::Quaterniond q_rate = Eigen::Quaterniond(0.0, w.x(), w.y(), w.z()) * q;
    Eigen::Map<Eigen::Vector4d>(out + 3) << q_rate.w(), q_rate.x(), q_rate.y(), q_rate.z();
    Eigen::Map<Eigen::Vector4d>(out + 3) *= 0.5;
    Eigen::Map<Vec6>{out + 7} = work_states_.A_WB[b];
    Eigen::Map<Vec3>(out + 10) /= dynamics_.length();
  }
  Eigen::Map<VecX>(out, dynamics_.works()) = dynamics_.WorkRates(t_s, work_states_) / work_unit_;
}

RunSummary FreeMotion::Accept(const State& x, double t_s) {
  nodes_.push_back(now_);
  if (nodes_.size() > kMostNodes) nodes_.pop_front();
  Unpack(x, &now_.states, &now_.work);
  now_.time_s = t_s;
  if (RunSummary summary = dynamics_.Project(t_s, &now_.states); !summary.ok()) return summary;
  now_.pivot = dynamics_.pivot();
  largest_pivot_ = std::max(largest_pivot_, now_.pivot);
  ++steps_;
  Watch();
  TryBridge();
  return RunSummary::Done();
}

RunSummary FreeMotion::NoWayOn(double dt_s) const {
  if (!trouble_.ok()) return trouble_;
  const bool singular = now_.pivot < kNear * largest_pivot_;
  RunSummary summary;
  summary.time_s = now_.time_s;
  if (!singular) {
    summary.stop = Stop::kNoConvergence;
    summary.message = std::string("the step of the integration became too small");
    summary.amount = dt_s;
    summary.unit = std::string("s");
    return summary;
  }
  summary.stop = Stop::kSingular;
  summary.where = dynamics_.SoftJoint(now_.states);
  summary.amount = now_.pivot / largest_pivot_;
  summary.unit = std::string("1");
  summary.message = fmt::format(
      "the motion runs into a singular pose: the loops lose a constraint, {} could move by itself "
      "(weakest constraint {:.1e} of its usual size), and the way on is not determined",
      summary.where, summary.amount);
  return summary;
}

RunSummary FreeMotion::TooManySteps() const {
  RunSummary summary;
  summary.stop = Stop::kNoConvergence;
  summary.time_s = now_.time_s;
  summary.amount = dt_;
  summary.unit = "s";
  summary.message = fmt::format(
      "{} steps reach t = {:.3g} s of {:g} s only (now {:.2g} s each): something moves much faster "
      "than the motion is sampled, as a stiff spring at a small mass does; make it softer, or the "
      "motion shorter",
      tried_steps_ - 1, now_.time_s, duration_s_, dt_);
  return summary;
}

RunSummary FreeMotion::LookAhead() {
  const double step_s = (now_.time_s - looked_s_) / static_cast<double>(kLook);
  looked_s_ = now_.time_s;
  dynamics_.Factor(now_.time_s, now_.states);
  const SpringMode mode = FastestSpringMode(mechanism_, now_.states, dynamics_.Motions());
  const double ahead = StepsToFollow(mode, step_s, duration_s_ - now_.time_s);
  const auto left = static_cast<double>(effort_.most_steps - tried_steps_);
  if (ahead <= kSurely * left) return RunSummary::Done();
  RunSummary summary = TooManySteps();
  summary.message = fmt::format(
      "spring '{}' lets the mechanism move at {:.2g} rad/s: {} steps reach t = {:.3g} s of {:g} s, "
      "and about {:.2g} more would be needed where {} are left; make it softer, or the motion "
      "shorter",
      mode.spring, mode.rate_per_s, tried_steps_, now_.time_s, duration_s_, ahead,
      effort_.most_steps - tried_steps_);
  return summary;
}

// One smooth piece, or a bridge beyond its end.
RunSummary FreeMotion::Segment(double to_s) {
  const auto rates = [this](const State& at, State& out, double t_s) { Rates(at, &out, t_s); };
  while (to_s - now_.time_s > 1e-14 * std::max(duration_s_, to_s)) {
    if (++tried_steps_ > effort_.most_steps) return TooManySteps();
    if (effort_.progress && tried_steps_ % kTold == 0) effort_.progress(now_.time_s / duration_s_);
    if (tried_steps_ % kLook == 0) {
      if (RunSummary summary = LookAhead(); !summary.ok()) return summary;
    }
    if (RunSummary summary = CheckFriction(); !summary.ok()) return summary;
    double t = now_.time_s;
    State x = Pack(now_);
    const double natural = dt_;
    double dt = std::min({dt_, largest_step_s_, to_s - t});
    if (now_.pivot < kApproach * largest_pivot_) dt = std::min(dt, 0.5 * TimeToSingular());
    const bool clipped = dt < natural, to_the_end = dt >= to_s - t;
    const double tried = dt;
    trouble_ = RunSummary::Done();
    const bool accepted =
        stepper_->controlled.try_step(rates, x, t, dt) == odeint::success && trouble_.ok();
    if (!accepted) {
      dt_ = trouble_.ok() ? dt : 0.25 * tried;
      if (dt_ > kSmallestStepShare * duration_s_) continue;
      return NoWayOn(dt_);
    }
    dt_ = clipped ? std::max(natural, dt) : dt;
    if (to_the_end) t = to_s;
    if (RunSummary summary = AcceptWithFriction(x, t, tried); !summary.ok()) return summary;
    if (tried < kSmallestStepShare * duration_s_ && !to_the_end) return NoWayOn(tried);
  }
  return RunSummary::Done();
}

RunSummary FreeMotion::AdvanceTo(double t_s) {
  for (const double at : breaks_) {
    if (at <= now_.time_s || at >= t_s) continue;
    if (RunSummary summary = Segment(at); !summary.ok()) return summary;
    nodes_.clear();
  }
  if (RunSummary summary = Segment(t_s); !summary.ok()) return summary;
  on_bridge_ = now_.time_s > t_s + 1e-14 * std::max(duration_s_, t_s);
  if (on_bridge_) return SampleBridge(t_s);
  return Accelerate(now_.time_s, &now_.states);
}

// Close to a singular pose, by rows chosen for every state.
RunSummary FreeMotion::Accelerate(double t_s, BodyStates* states) {
  return now_.pivot > kApproach * largest_pivot_ ? dynamics_.AccelerateNear(t_s, states)
                                                 : dynamics_.Accelerate(t_s, states);
}

}  // namespace mbv::internal
