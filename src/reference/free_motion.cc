#include "reference/free_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <cmath>

#include "core/spatial.h"
#include "reference/closure_solver.h"
#include "reference/square_system.h"

namespace mbv::internal {
namespace {

namespace odeint = boost::numeric::odeint;

constexpr size_t kPerBody = 13;          // position, quaternion (w, x, y, z), twist
constexpr double kSmallestStep = 1e-10;  // of the duration
// A pose counts as near singular while its pivot is below this share of the largest of the run, and
// as passed if the search between the nodes brings it below the second.
constexpr double kNear = 0.03, kPassed = 1e-3;

void Pack(const BodyStates& states, std::vector<double>* x) {
  x->resize(kPerBody * (states.X_WB.size() - 1));
  double* out = x->data();
  for (size_t b = 1; b < states.X_WB.size(); ++b, out += kPerBody) {
    Eigen::Map<Vec3>{out} = states.X_WB[b].translation();
    const Eigen::Quaterniond q(Mat3(states.X_WB[b].linear()));
    Eigen::Map<Eigen::Vector4d>(out + 3) << q.w(), q.x(), q.y(), q.z();
    Eigen::Map<Vec6>{out + 7} = states.V_WB[b];
  }
}

void Unpack(const std::vector<double>& x, BodyStates* states) {
  const double* in = x.data();
  for (size_t b = 1; b < states->X_WB.size(); ++b, in += kPerBody) {
    states->X_WB[b].translation() = Eigen::Map<const Vec3>(in);
    const Eigen::Quaterniond q(in[3], in[4], in[5], in[6]);
    states->X_WB[b].linear() = q.normalized().toRotationMatrix();
    states->V_WB[b] = Eigen::Map<const Vec6>(in + 7);
  }
}

// Times at which a force, load or command changes its formula.
std::vector<double> BreaksOf(const Motion& motion) {
  std::vector<double> breaks;
  const auto add = [&breaks](const Profile& profile) {
    const std::vector<double> times = BreakTimes(profile);
    breaks.insert(breaks.end(), times.begin(), times.end());
  };
  for (const Command& command : motion.commands) add(command.profile);
  for (const DriveForce& force : motion.forces) add(force.force);
  for (const Load& load : motion.loads) {
    for (int c = 0; c < 3; ++c) {
      add(load.force[c]);
      add(load.moment[c]);
    }
  }
  std::sort(breaks.begin(), breaks.end());
  return breaks;
}

}  // namespace

struct FreeMotion::Stepper {
  using Fehlberg = odeint::runge_kutta_fehlberg78<State>;
  odeint::controlled_runge_kutta<Fehlberg> controlled;

  explicit Stepper(double tolerance)
      : controlled(
            odeint::default_error_checker<double, odeint::range_algebra,
                                          odeint::default_operations>(tolerance, tolerance)) {}
};

FreeMotion::FreeMotion(const Mechanism& mechanism, const Motion& motion, double tolerance)
    : duration_s_(motion.duration_s),
      dynamics_(mechanism, motion),
      stepper_(std::make_unique<Stepper>(tolerance)),
      breaks_(BreaksOf(motion)),
      dt_(std::min(motion.sample_s, 1e-3)) {
  now_.states.Resize(mechanism.bodies.size());
  work_ = now_.states;
}

FreeMotion::~FreeMotion() = default;

RunSummary FreeMotion::Start(const BodyStates& states) {
  now_.states = states;
  now_.time_s = 0.0;
  nodes_ = 1;
  if (RunSummary summary = dynamics_.Project(0.0, &now_.states); !summary.ok()) return summary;
  RunSummary summary = dynamics_.Accelerate(0.0, &now_.states);
  now_.pivot = largest_pivot_ = dynamics_.pivot();
  return summary;
}

void FreeMotion::Rates(const State& x, State* rates, double t_s) {
  rates->assign(x.size(), 0.0);
  if (!trouble_.ok()) return;
  ++evaluations_;
  Unpack(x, &work_);
  trouble_ = dynamics_.Accelerate(t_s, &work_);
  if (!trouble_.ok()) return;
  double* out = rates->data();
  const double* in = x.data();
  for (size_t b = 1; b < work_.X_WB.size(); ++b, out += kPerBody, in += kPerBody) {
    Eigen::Map<Vec3>{out} = work_.V_WB[b].tail<3>();
    const Eigen::Quaterniond q(in[3], in[4], in[5], in[6]);
    const Vec3 w = work_.V_WB[b].head<3>();
    const Eigen::Quaterniond q_rate = Eigen::Quaterniond(0.0, w.x(), w.y(), w.z()) * q;
    Eigen::Map<Eigen::Vector4d>(out + 3) << q_rate.w(), q_rate.x(), q_rate.y(), q_rate.z();
    Eigen::Map<Eigen::Vector4d>(out + 3) *= 0.5;
    Eigen::Map<Vec6>{out + 7} = work_.A_WB[b];
  }
}

RunSummary FreeMotion::Accept(const State& x, double t_s) {
  before_ = std::move(last_);
  last_ = now_;
  Unpack(x, &now_.states);
  now_.time_s = t_s;
  if (RunSummary summary = dynamics_.Project(t_s, &now_.states); !summary.ok()) return summary;
  now_.pivot = dynamics_.pivot();
  largest_pivot_ = std::max(largest_pivot_, now_.pivot);
  ++nodes_;
  ++steps_;
  Watch();
  return RunSummary::Done();
}

// One smooth piece.
RunSummary FreeMotion::Segment(double to_s) {
  State x;
  Pack(now_.states, &x);
  double t = now_.time_s;
  const auto rates = [this](const State& at, State& out, double t_s) { Rates(at, &out, t_s); };
  while (to_s - t > 1e-14 * std::max(1.0, to_s)) {
    const bool clipped = dt_ > to_s - t;
    const double natural = dt_;
    double dt = std::min(dt_, to_s - t);
    trouble_ = RunSummary::Done();
    const State x_before = x;
    const double t_before = t;
    const bool accepted =
        stepper_->controlled.try_step(rates, x, t, dt) == odeint::success && trouble_.ok();
    if (!accepted) {
      x = x_before;
      t = t_before;
      dt_ = trouble_.ok() ? dt : 0.25 * std::min(natural, to_s - t);
      if (dt_ > kSmallestStep * duration_s_) continue;
      if (!trouble_.ok()) return trouble_;
      return {.stop = Stop::kNoConvergence,
              .message = "the step of the integration became too small",
              .time_s = t,
              .where = {},
              .amount = dt_,
              .unit = "s"};
    }
    dt_ = clipped ? std::max(natural, dt) : dt;
    if (clipped) t = to_s;
    if (RunSummary summary = Accept(x, t); !summary.ok()) return summary;
    Pack(now_.states, &x);
  }
  return RunSummary::Done();
}

RunSummary FreeMotion::AdvanceTo(double t_s) {
  for (const double at : breaks_) {
    if (at <= now_.time_s || at >= t_s) continue;
    if (RunSummary summary = Segment(at); !summary.ok()) return summary;
  }
  if (RunSummary summary = Segment(t_s); !summary.ok()) return summary;
  return dynamics_.Accelerate(t_s, &now_.states);
}

// Looks for a singular pose around the last node where its pivot is a local minimum.
void FreeMotion::Watch() {
  if (nodes_ < 3 || !(last_.pivot < before_.pivot && last_.pivot <= now_.pivot)) return;
  if (last_.pivot > 0.5 * largest_pivot_) return;
  const SingularPassage passage = Closest(last_, before_.time_s, now_.time_s);
  if (passage.pivot < kNear * largest_pivot_) passages_.push_back(passage);
}

// Golden-section search for the smallest pivot, on parabolas through the node.
SingularPassage FreeMotion::Closest(const Node& from, double first_s, double last_s) {
  BodyStates states;
  const auto pivot_at = [&](double t_s) {
    const double dt = t_s - from.time_s;
    states = from.states;
    MoveBodies(dt * Stack(states.V_WB) + 0.5 * dt * dt * Stack(states.A_WB), &states);
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
