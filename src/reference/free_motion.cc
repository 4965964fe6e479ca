#include "reference/free_motion.h"

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <boost/array.hpp>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <complex>
#include <limits>
#include <utility>

#include "mechanism/motion.h"
#include "reference/closure_solver.h"
#include "reference/element_forces.h"
#include "reference/force_solver.h"
#include "reference/square_system.h"

namespace mbv::internal {
namespace {

namespace odeint = boost::numeric::odeint;

constexpr double kSmallestStepShare = 1e-10;  // of the duration
constexpr int kMostBranched = 4;  // at one time: a branch that is left for one that leads back
constexpr double kCornerShare = 1e-10;  // of a step: how well a corner is found
constexpr double kJump = 1e-6;          // a smaller share of a load is not a jump
// Below this share of the largest pivot steps go half the way to the singular pose at most.
constexpr double kApproach = 0.2;
constexpr size_t kMostNodes = 600;
constexpr long kProgressSteps = 64;  // steps from one report of the progress to the next
// Steps from one look ahead to the next; and how far above what is left the estimate must be, which
// is good to some percent.
constexpr long kLook = 1000;
constexpr double kSurely = 1.1;

// RK8(7)13M [Prince, Dormand 1981, Table 2]. Its error estimate compares weights at all times of a
// step. That of Fehlberg's 7(8), (41/840) h (k₁ + k₁₁ − k₁₂ − k₁₃) with stages at both ends of the
// step only, vanishes where accelerations depend on time alone, and does not see what jumps between
// the ends.
constexpr size_t kStages = 13;
using Scheme = odeint::explicit_error_generic_rk<kStages, 8, 8, 7, std::vector<double>>;

template <typename... Numbers>
boost::array<double, sizeof...(Numbers)> Row(Numbers... numbers) {
  return {{static_cast<double>(numbers)...}};
}

}  // namespace

class PrinceDormand : public Scheme {
 public:
  PrinceDormand() : Scheme(Inner(), Eighth(), LessSeventh(), Times()) {}

 private:
  static coef_a_type Inner() {
    return coef_a_type(
        Row(1.0 / 18), Row(1.0 / 48, 1.0 / 16), Row(1.0 / 32, 0, 3.0 / 32),
        Row(5.0 / 16, 0, -75.0 / 64, 75.0 / 64), Row(3.0 / 80, 0, 0, 3.0 / 16, 3.0 / 20),
        Row(29443841.0 / 614563906, 0, 0, 77736538.0 / 692538347, -28693883.0 / 1125000000,
            23124283.0 / 1800000000),
        Row(16016141.0 / 946692911, 0, 0, 61564180.0 / 158732637, 22789713.0 / 633445777,
            545815736.0 / 2771057229, -180193667.0 / 1043307555),
        Row(39632708.0 / 573591083, 0, 0, -433636366.0 / 683701615, -421739975.0 / 2616292301,
            100302831.0 / 723423059, 790204164.0 / 839813087, 800635310.0 / 3783071287),
        Row(246121993.0 / 1340847787, 0, 0, -37695042795.0 / 15268766246, -309121744.0 / 1061227803,
            -12992083.0 / 490766935, 6005943493.0 / 2108947869, 393006217.0 / 1396673457,
            123872331.0 / 1001029789),
        Row(-1028468189.0 / 846180014, 0, 0, 8478235783.0 / 508512852, 1311729495.0 / 1432422823,
            -10304129995.0 / 1701304382, -48777925059.0 / 3047939560, 15336726248.0 / 1032824649,
            -45442868181.0 / 3398467696, 3065993473.0 / 597172653),
        Row(185892177.0 / 718116043, 0, 0, -3185094517.0 / 667107341, -477755414.0 / 1098053517,
            -703635378.0 / 230739211, 5731566787.0 / 1027545527, 5232866602.0 / 850066563,
            -4093664535.0 / 808688257, 3962137247.0 / 1805957418, 65686358.0 / 487910083),
        Row(403863854.0 / 491063109, 0, 0, -5068492393.0 / 434740067, -411421997.0 / 543043805,
            652783627.0 / 914296604, 11173962825.0 / 925320556, -13158990841.0 / 6184727034,
            3936647629.0 / 1978049680, -160528059.0 / 685178525, 248638103.0 / 1413531060, 0));
  }
  static coef_c_type Times() {
    return Row(0, 1.0 / 18, 1.0 / 12, 1.0 / 8, 5.0 / 16, 3.0 / 8, 59.0 / 400, 93.0 / 200,
               5490023248.0 / 9719169821, 13.0 / 20, 1201146811.0 / 1299019798, 1, 1);
  }
  static coef_b_type Eighth() {
    return Row(14005451.0 / 335480064, 0, 0, 0, 0, -59238493.0 / 1068277825,
               181606767.0 / 758867731, 561292985.0 / 797845732, -1041891430.0 / 1371343529,
               760417239.0 / 1151165299, 118820643.0 / 751138087, -528747749.0 / 2220607170,
               1.0 / 4);
  }
  static coef_b_type LessSeventh() {
    const coef_b_type seventh =
        Row(13451932.0 / 455176623, 0, 0, 0, 0, -808719846.0 / 976000145, 1757004468.0 / 5645159321,
            656045339.0 / 265891186, -3867574721.0 / 1518517206, 465885868.0 / 322736535,
            53011238.0 / 667516719, 2.0 / 45, 0);
    coef_b_type less = Eighth();
    for (size_t i = 0; i < kStages; ++i) less[i] -= seventh[i];
    return less;
  }
};

struct FreeMotion::Stepper {
  odeint::controlled_runge_kutta<PrinceDormand> controlled;
  PrinceDormand plain = {};  ///< for steps of a given length

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
      motion_(motion),
      duration_s_(motion.duration_s),
      largest_step_s_(largest_step_s),
      effort_(std::move(effort)),
      dynamics_(mechanism, motion),
      stepper_(std::make_unique<Stepper>(tolerance)),
      breaks_(BreakTimes(motion)),
      time_(motion),
      dt_(std::min({motion.sample_s, largest_step_s, 1e-3})),
      tolerance_(tolerance),
      branching_(BranchingFunctions(mechanism, motion)),
      fresh_(mechanism.elements.size(), 0) {
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    if (HasFriction(mechanism.elements[e])) friction_elements_.push_back(e);
    const auto* stop = std::get_if<StopLaw>(&mechanism.elements[e].law);
    const bool rigid = stop != nullptr && stop->rigid();
    const bool branches = std::holds_alternative<ExpressionLaw>(mechanism.elements[e].law);
    if (!HasCorners(mechanism.elements[e]) || rigid) continue;
    (branches ? branch_elements_ : corner_elements_).push_back(e);
  }
  FindEnds();
  now_.states.Resize(mechanism.bodies.size());
  if (has_branches()) {
    const int functions = branching_.empty() ? 0 : branching_.back().function->number + 1;
    now_.states.branches.assign(mechanism.elements.size() + static_cast<size_t>(functions),
                                kAnyBranch);
  }
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
  const std::vector<int> branches = now_.states.branches;
  now_.states = states;
  now_.states.branches = branches;
  start_W_.clear();
  for (const Pose& X_WB : states.X_WB) start_W_.push_back(X_WB.translation());
  now_.work.setZero(dynamics_.works());
  now_.time_s = 0.0;
  nodes_.clear();
  if (RunSummary summary = dynamics_.Project(0.0, &now_.states); !summary.ok()) return summary;
  RunSummary summary = dynamics_.Accelerate(0.0, &now_.states);
  now_.pivot = largest_pivot_ = dynamics_.pivot();
  if (summary.ok() && !friction_elements_.empty()) summary = BeginFriction();
  if (summary.ok() && !ends_.empty()) summary = StartStops();
  if (!summary.ok()) return summary;
  if (has_branches()) summary = TakeBranches(BranchesAt(Pack(now_), 0.0));
  NoteFriction();
  NoteCorners();
  return summary;
}

void FreeMotion::Rates(const State& x, State* rates, double t_s) {
  rates->assign(x.size(), 0.0);
  if (!trouble_.ok()) return;
  ++evaluations_;
  work_states_.coupled = now_.states.coupled;
  work_states_.turns = now_.states.turns;
  work_states_.branches = now_.states.branches;
  Unpack(x, &work_states_, nullptr);
  t_s = time_(t_s);
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
  const size_t crossings = crossings_.size();
  Watch();
  // Beyond a pose that no bridge leads over, steps may have gone on in another assembly.
  if (friction_elements_.empty() && crossings_.size() > crossings && Passes(crossings_.back())) {
    trouble_ = RunSummary::Done();
    return NoWayOn(0.0);
  }
  TryBridge();
  return RunSummary::Done();
}

VecX FreeMotion::LoadsAfter(double h) {
  const double t_s = now_.time_s + h;
  BodyStates states = StatesOf(StepFrom(Pack(now_), h));
  states.turns = now_.states.turns;
  states.branches.clear();
  CommandSample at;
  EvaluateMotion(motion_, t_s, &at);
  const auto of_loads = 6 * static_cast<Eigen::Index>(at.loads.size());
  const auto of_drives = static_cast<Eigen::Index>(motion_.forces.size());
  VecX loads =
      VecX::Zero(of_loads + of_drives + static_cast<Eigen::Index>(mechanism_.elements.size()));
  for (size_t k = 0; k < at.loads.size(); ++k) {
    const LoadSample load = AtStates(mechanism_, states, at.loads[k]);
    loads.segment<6>(6 * static_cast<Eigen::Index>(k)) << load.force, load.moment;
  }
  for (size_t k = 0; k < motion_.forces.size(); ++k) {
    loads[of_loads + static_cast<Eigen::Index>(k)] =
        ForceAtStates(mechanism_, states, motion_.forces[k], t_s);
  }
  for (size_t e = 0; e < mechanism_.elements.size(); ++e) {
    const auto* law = std::get_if<ExpressionLaw>(&mechanism_.elements[e].law);
    if (law == nullptr) continue;
    const ScalarRow row = ElementRow(mechanism_, e, states);
    loads[of_loads + of_drives + static_cast<Eigen::Index>(e)] =
        law->force(row.value, RateOf(row, states.V_WB));
  }
  return loads;
}

// What jumps changes by the same amount however short the time is; what is smooth by 2^−12 of it
// after twelve halvings. (Profiles of time have break times and do not jump within a segment.)
std::optional<FreeMotion::LoadJump> FreeMotion::JumpHere() {
  double from = -10.0 * kSmallestStepShare * duration_s_, to = -from;
  VecX before = LoadsAfter(from), after = LoadsAfter(to);
  const VecX sizes = before.cwiseAbs().cwiseMax(after.cwiseAbs());
  if (sizes.size() == 0 || sizes.maxCoeff() == 0.0) return {};
  const VecX scale = sizes.cwiseMax(1e-9 * sizes.maxCoeff());
  Eigen::Index most = 0;
  const double whole = (after - before).cwiseAbs().cwiseQuotient(scale).maxCoeff(&most);
  if (!(whole > kJump)) return {};
  for (int halving = 0; halving < 12; ++halving) {
    const double middle = 0.5 * (from + to);
    const VecX at = LoadsAfter(middle);
    const bool first = std::abs(at[most] - before[most]) > std::abs(after[most] - at[most]);
    (first ? to : from) = middle;
    (first ? after : before) = at;
  }
  trouble_ = RunSummary::Done();
  if (!(std::abs(after[most] - before[most]) > 0.5 * whole * scale[most])) return {};
  LoadJump jump{.part = {}, .unit = "N", .before = before[most], .after = after[most]};
  const auto at = static_cast<size_t>(most), loads = 6 * motion_.loads.size();
  if (at < loads) {
    const bool force = at % 6 < 3;
    jump.part = fmt::format("loads.{}.{}[{}]", motion_.loads[at / 6].name,
                            force ? "force" : "moment", at % 3);
    if (!force) jump.unit = "N m";
  } else if (at < loads + motion_.forces.size()) {
    const DriveForce& force = motion_.forces[at - loads];
    jump.part = PathOf(mechanism_, force);
    jump.unit = ForceUnit(mechanism_, mechanism_.drives[static_cast<size_t>(force.drive)]);
  } else {
    const ForceElement& element = mechanism_.elements[at - loads - motion_.forces.size()];
    jump.part = element.name;
    if (!ActsOnLength(mechanism_, element)) jump.unit = "N m";
  }
  return jump;
}

RunSummary FreeMotion::NoWayOn(double dt_s) {
  if (!trouble_.ok()) return trouble_;
  const bool singular = now_.pivot < kNear * largest_pivot_;
  RunSummary summary;
  summary.time_s = now_.time_s;
  if (!singular) {
    summary.stop = Stop::kNoConvergence;
    if (const std::optional<LoadJump> jump = JumpHere()) {
      summary.where = jump->part;
      summary.names_where = summary.states_time = true;
      summary.message = fmt::format(
          "{} jumps from {:.4g} to {:.4g} {} at t = {:.6g} s, which no step of the integration can "
          "follow; let it change within a short time or way, as 0.5*(1 + tanh(x/w)) does",
          jump->part, jump->before, jump->after, jump->unit, now_.time_s);
      return summary;
    }
    summary.message = std::string("the step of the integration became too small");
    summary.amount = dt_s;
    summary.unit = std::string("s");
    return summary;
  }
  summary.stop = Stop::kSingular;
  summary.where = dynamics_.SoftJoint(now_.states);
  summary.names_where = true;
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
  summary.states_time = true;
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
  time_.StartFrom(now_.time_s);
  if (!in_touch_.empty()) {  // forces may have jumped
    if (RunSummary summary = KeepInTouch(in_touch_); !summary.ok()) return summary;
  }
  if (!motion_.switches.empty()) {
    if (RunSummary summary = SwitchFriction(to_s); !summary.ok()) return summary;
    NoteFriction();
  }
  const auto rates = [this](const State& at, State& out, double t_s) { Rates(at, &out, t_s); };
  while (to_s - now_.time_s > 1e-14 * std::max(duration_s_, to_s)) {
    if (++tried_steps_ > effort_.most_steps) return TooManySteps();
    if (effort_.progress && tried_steps_ % kProgressSteps == 0) {
      effort_.progress(now_.time_s / duration_s_);
    }
    if (tried_steps_ % kLook == 0) {
      if (RunSummary summary = LookAhead(); !summary.ok()) return summary;
    }
    if (RunSummary summary = CheckFriction(); !summary.ok()) return summary;
    NoteFriction();
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
    BranchEnd branch{.after_s = tried};
    if (has_branches()) branch = TimeToBranch(tried, x);
    if (branch.after_s == 0.0) {  // left at once, for good or back and forth
      if (++branched_here_ > kMostBranched) return NoWayOn(tried);
      if (RunSummary summary = TakeBranches(branch.next); !summary.ok()) return summary;
      continue;
    }
    if (branch.after_s < tried) x = StepFrom(Pack(now_), branch.after_s);
    const double corner =
        corner_elements_.empty() ? branch.after_s : TimeToCorner(branch.after_s, x);
    const bool leaves_branch = branch.after_s < tried && corner == branch.after_s;
    if (corner < tried) {
      x = StepFrom(Pack(now_), corner);
      if (!trouble_.ok()) return trouble_;
      t = now_.time_s + corner;
    } else if (to_the_end) {
      t = to_s;
    }
    const auto impact = ends_.empty() ? std::nullopt : FirstImpact(corner, x);
    if (impact) {
      x = StepFrom(Pack(now_), impact->after_s);
      if (!trouble_.ok()) return trouble_;
      t = impact->after_s < corner ? now_.time_s + impact->after_s : t;
    }
    RunSummary accepted_at =
        impact && impact->after_s == 0.0 ? RunSummary::Done() : AcceptWithFriction(x, t, corner);
    if (accepted_at.ok() && impact) {
      accepted_at = impact->hits.empty() ? LetGo(impact->leaves) : Strike(impact->hits);
    }
    if (!accepted_at.ok()) return accepted_at;
    branched_here_ = 0;
    if (leaves_branch && now_.time_s == t) {
      if (RunSummary summary = TakeBranches(branch.next); !summary.ok()) return summary;
    }
    NoteFriction();
    NoteCorners();
    if (tried < kSmallestStepShare * duration_s_ && !to_the_end) return NoWayOn(tried);
  }
  return RunSummary::Done();
}

std::vector<int> FreeMotion::PiecesAt(const State& x) const {
  const BodyStates states = StatesOf(x);
  std::vector<int> pieces;
  for (const size_t e : corner_elements_) {
    const ScalarRow row = ElementRow(mechanism_, e, states);
    pieces.push_back(PieceOf(mechanism_.elements[e], row.value, RateOf(row, states.V_WB)));
  }
  return pieces;
}

std::vector<int> FreeMotion::BranchesAt(const State& x, double t_s) const {
  std::vector<int> branches(now_.states.branches.size(), kAnyBranch);
  if (branches.empty()) return branches;
  const BodyStates states = StatesOf(x);
  for (const size_t e : branch_elements_) {
    const ScalarRow row = ElementRow(mechanism_, e, states);
    branches[e] = PieceOf(mechanism_.elements[e], row.value, RateOf(row, states.V_WB));
  }
  for (const auto& [path, function] : branching_) {
    branches[mechanism_.elements.size() + static_cast<size_t>(function->number)] =
        function->branch(time_(t_s), InputsOf(mechanism_, states, *function));
  }
  return branches;
}

template <typename Stays>
double FreeMotion::TimeOfChange(double h, const Stays& stays) {
  const State from = Pack(now_);
  double before = 0.0, beyond = h;
  while (beyond - before > kCornerShare * h) {
    const double t = 0.5 * (before + beyond);
    (stays(StepFrom(from, t), t) ? before : beyond) = t;
    if (!std::exchange(trouble_, RunSummary::Done()).ok()) return h;
  }
  return before == 0.0 ? 0.0 : beyond;
}

FreeMotion::BranchEnd FreeMotion::TimeToBranch(double h, const State& to) {
  const std::vector<int>& now = now_.states.branches;
  BranchEnd end{.after_s = h, .next = BranchesAt(to, now_.time_s + h)};
  if (end.next == now) return end;
  end.after_s = TimeOfChange(h, [&](const State& x, double after_s) {
    std::vector<int> at = BranchesAt(x, now_.time_s + after_s);
    if (at == now) return true;
    end.next = std::move(at);
    return false;
  });
  return end;
}

// Forces may jump.
RunSummary FreeMotion::TakeBranches(std::vector<int> branches) {
  now_.states.branches = std::move(branches);
  nodes_.clear();
  for (const size_t e : branch_elements_) {
    log_.Note(mechanism_.elements[e], now_.time_s, Happening::kBranch, now_.states.branches[e]);
  }
  for (const auto& [path, function] : branching_) {
    const size_t at = mechanism_.elements.size() + static_cast<size_t>(function->number);
    log_.Note(path, now_.time_s, Happening::kBranch, now_.states.branches[at]);
  }
  return in_touch_.empty() ? RunSummary::Done() : KeepInTouch(in_touch_);
}

// At a dead centre friction neither rests nor slides: it goes on as before.
void FreeMotion::NoteFriction() {
  const FrictionPhase& phase = dynamics_.phase();
  const auto note = [&](size_t e, Happening now) {
    log_.Note(mechanism_.elements[e], now_.time_s, now);
  };
  for (const size_t e : all_friction_) {
    if (std::ranges::count(off_, e) > 0) note(e, Happening::kSwitchedOff);
  }
  for (const size_t e : phase.held) {
    if (HasFriction(mechanism_.elements[e])) note(e, Happening::kRests);
  }
  for (const size_t e : friction_elements_) {
    if (phase.sign[e] != 0) note(e, HappeningAt(phase.sign[e]));
  }
}

void FreeMotion::NoteCorners() {
  if (corner_elements_.empty()) return;
  const std::vector<int> pieces = PiecesAt(Pack(now_));
  for (size_t k = 0; k < pieces.size(); ++k) {
    const ForceElement& element = mechanism_.elements[corner_elements_[k]];
    log_.Note(element, now_.time_s, HappeningOn(element, pieces[k]), pieces[k]);
  }
}

// Where some law is on another piece after the step: the time just beyond the corner. A corner at
// the very start is none.
double FreeMotion::TimeToCorner(double h, const State& to) {
  const std::vector<int> pieces = PiecesAt(Pack(now_));
  if (PiecesAt(to) == pieces) return h;
  const double t =
      TimeOfChange(h, [&](const State& x, double /*after_s*/) { return PiecesAt(x) == pieces; });
  return t < kSmallestStepShare * duration_s_ ? h : t;
}

RunSummary FreeMotion::AdvanceTo(double t_s) {
  for (const double at : breaks_) {
    if (at <= now_.time_s || at >= t_s) continue;
    if (RunSummary summary = Segment(at); !summary.ok()) return summary;
    nodes_.clear();
  }
  if (RunSummary summary = Segment(t_s); !summary.ok()) return summary;
  if (time_.IsJump(now_.time_s)) {  // a sample shows what follows
    time_.StartFrom(now_.time_s);
    RunSummary summary = SwitchFriction(now_.time_s + motion_.sample_s);
    if (summary.ok()) summary = CheckFriction();
    if (summary.ok() && !in_touch_.empty()) summary = KeepInTouch(in_touch_);
    if (!summary.ok()) return summary;
    NoteFriction();
  }
  impacts_here_ = 0;
  on_bridge_ = now_.time_s > t_s + 1e-14 * std::max(duration_s_, t_s);
  if (on_bridge_) return SampleBridge(t_s);
  return Accelerate(now_.time_s, &now_.states);
}

// Close to a singular pose, by rows chosen for every state.
RunSummary FreeMotion::Accelerate(double t_s, BodyStates* states) {
  return now_.pivot > kApproach * largest_pivot_ ? dynamics_.AccelerateNear(t_s, states)
                                                 : dynamics_.Accelerate(t_s, states);
}

namespace {

// Steps grow by this root of the amplitude: the scheme of order 7 is the one whose error is
// controlled.
constexpr double kOrder = 7.0;
// Angle |λh| [rad] beyond which a step of RK8(7)13M is unstable for every λ in the left half plane,
// so that the estimate is no larger than what is needed; and one so small that no tolerance above
// round-off asks for it.
constexpr double kStable = 5.5, kTooFine = 0.02;

// What yields along a coordinate of gradient u.
struct Yielding {
  std::string name;
  VecX u;
  double stiffness = 0.0, damping = 0.0;
};

// A coordinate's gradient along the motions.
VecX Along(const ScalarRow& row, const MatX& R) {
  VecX u = VecX::Zero(R.cols());
  if (row.parent > 0) u += R.middleRows<6>(6 * (row.parent - 1)).transpose() * row.J_parent;
  if (row.child > 0) u += R.middleRows<6>(6 * (row.child - 1)).transpose() * row.J_child;
  return u;
}

// Springs, then force elements.
std::vector<Yielding> YieldingParts(const Mechanism& mechanism, const BodyStates& states,
                                    const MatX& motions) {
  std::vector<Yielding> parts;
  for (const SpringDamper& spring : mechanism.springs) {
    const ScalarRow row = LengthRow(spring, mechanism, states);
    parts.push_back({spring.name, Along(row, motions), spring.stiffness, spring.damping});
  }
  const std::vector<ScalarRow> rows = ElementRows(mechanism, states);
  const double length = CharacteristicLength(mechanism);
  for (size_t e = 0; e < rows.size(); ++e) {
    const ForceElement& element = mechanism.elements[e];
    const double unit = ActsOnLength(mechanism, element) ? length : 1.0;
    const ElementSlope slope = SlopeOf(element, rows[e].value, unit);
    if (slope.stiffness == 0.0 && slope.damping == 0.0) continue;
    parts.push_back({element.name, Along(rows[e], motions), slope.stiffness, slope.damping});
  }
  return parts;
}

}  // namespace

SpringMode FastestSpringMode(const Mechanism& mechanism, const BodyStates& states,
                             const MatX& motions) {
  SpringMode mode;
  const Eigen::Index n = motions.cols();
  const std::vector<Yielding> parts = YieldingParts(mechanism, states, motions);
  if (parts.empty() || n == 0) return mode;
  MatX K = MatX::Zero(n, n), C = MatX::Zero(n, n);
  for (const Yielding& part : parts) {
    K += part.stiffness * part.u * part.u.transpose();
    C += part.damping * part.u * part.u.transpose();
  }
  const Eigen::LDLT<MatX> inertia(MatX(motions.transpose() * Momenta(mechanism, states, motions)));
  MatX A = MatX::Zero(2 * n, 2 * n);
  A.topRightCorner(n, n).setIdentity();
  A.bottomLeftCorner(n, n) = -inertia.solve(K);
  A.bottomRightCorner(n, n) = -inertia.solve(C);
  if (!A.allFinite()) return mode;
  const Eigen::EigenSolver<MatX> modes(A);
  Eigen::Index fastest = 0;
  mode.rate_per_s = modes.eigenvalues().cwiseAbs().maxCoeff(&fastest);
  mode.decay_per_s = std::max(0.0, -modes.eigenvalues()[fastest].real());
  const Eigen::VectorXcd x = modes.eigenvectors().col(fastest).head(n);
  double most = -1.0;
  for (const Yielding& part : parts) {
    const double share = (std::abs(part.stiffness) + part.damping * mode.rate_per_s) *
                         std::norm(part.u.cast<std::complex<double>>().dot(x));
    if (share <= most) continue;
    most = share;
    mode.spring = part.name;
  }
  return mode;
}

double StepsToFollow(const SpringMode& mode, double step_s, double ahead_s) {
  const double angle = mode.rate_per_s * step_s;
  if (!(angle > kTooFine && angle < kStable)) return 0.0;
  if (!(mode.decay_per_s > 0.0)) return ahead_s / step_s;
  // Until the steps have grown to what is stable, and from there on.
  const double grows = mode.decay_per_s / kOrder;
  const double growing_s = std::min(ahead_s, std::log(kStable / angle) / grows);
  return -std::expm1(-grows * growing_s) / (grows * step_s) +
         mode.rate_per_s * (ahead_s - growing_s) / kStable;
}

// Free motion over singular poses: where they lie, and the bridge on which a motion passes one.

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
// Where on a bridge its rates are compared with those of the dynamics; not near the pose.
constexpr std::array<double, 3> kCompared = {0.25, 0.75, 1.0};
// Accelerations divide the round-off of a bridge's states by the pivot: up to this share of rates.
constexpr double kDivided = 1e-6;

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
  const double kinetic = std::max(from.kinetic, to.kinetic);
  if (!(moved < kMoved && std::abs(change) <= kUnbalanced * kinetic)) return false;
  return std::ranges::all_of(kCompared, [&](double share) {
    return RatesFit(way, now_.time_s + share * (at_s - now_.time_s), at_s, kinetic);
  });
}

// States and work come from one polynomial, which can balance energy along a wrong motion: here its
// rates meet the dynamics. With the squares of the distances to its nodes the polynomial's error e
// grows as ∏ (t − t_k)², so that e = ė / Σ 2/(t − t_k) <= ė (t_b − t_0)/2 for a bridge from t_0 to
// t_b. Such errors of pose and work have the limits of Land().
bool FreeMotion::RatesFit(const Hermite& way, double t_s, double to_s, double kinetic) {
  VecX value, of_way;
  way.Evaluate(t_s, &value, &of_way);
  State computed;
  trouble_ = RunSummary::Done();
  Rates({value.begin(), value.end()}, &computed, t_s);
  if (!trouble_.ok()) return false;
  const VecX error = 0.5 * (to_s - now_.time_s) *
                     (of_way - Eigen::Map<const VecX>(computed.data(), of_way.size()));
  const auto bodies = static_cast<Eigen::Index>(now_.states.X_WB.size()) - 1;
  const Eigen::Index works = kPerBody * bodies;
  double pose = 0.0, twist = 0.0, fastest = 0.0;
  for (Eigen::Index at = 0; at < works; at += kPerBody) {
    pose = std::max(pose, error.segment<7>(at).norm());
    twist = std::max(twist, error.segment<6>(at + 7).norm());
    fastest = std::max(fastest, value.segment<6>(at + 7).norm());
  }
  const double work = work_unit_ * std::abs(error.tail(error.size() - works).sum());
  return error.allFinite() && pose < kMoved && twist <= kDivided * fastest &&
         work <= kUnbalanced * kinetic;
}

void FreeMotion::TryBridge() {
  // What slides could stop on it, what moves could hit a stop.
  if (!friction_elements_.empty() || !ends_.empty()) return;
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
  const bool holds = Land(*way, landing, &end);
  trouble_ = RunSummary::Done();
  if (!holds) return;  // a later one is shorter
  const auto states_at = [&](double t_s, BodyStates* states) {
    VecX x, rates;
    way->Evaluate(t_s, &x, &rates);
    *states = now_.states;
    Unpack({x.begin(), x.end()}, states, nullptr);
  };
  crossings_.push_back(Closest(now_.time_s, landing, states_at));
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
  const SingularityCrossing crossing = Closest(before.time_s, now_.time_s, states_at);
  if (crossing.pivot < kNear * largest_pivot_) crossings_.push_back(crossing);
}

// Golden-section search for the smallest pivot. It falls and rises like |t|, so that the time can
// be found to round-off; Boost's minimiser stops at its root, where a parabola would be flat.
template <typename StatesAt>
SingularityCrossing FreeMotion::Closest(double first_s, double last_s, const StatesAt& states_at) {
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
  SingularityCrossing crossing{.time_s = t_s, .pivot = pivot_at(t_s)};
  crossing.joint = dynamics_.SoftJoint(states);
  return crossing;
}

bool FreeMotion::Passes(const SingularityCrossing& crossing) const {
  return crossing.pivot < kPassed * largest_pivot_;
}

std::vector<SingularityCrossing> FreeMotion::Crossings() const {
  std::vector<SingularityCrossing> crossings = crossings_;
  for (SingularityCrossing& crossing : crossings) {
    crossing.pivot /= largest_pivot_;
    crossing.passed = crossing.pivot < kPassed;
  }
  return crossings;
}

}  // namespace mbv::internal
