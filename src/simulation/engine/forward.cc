// Forward mode: the step loops of the corrected and of the stock engine.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "mechanism/event_log.h"
#include "simulation/engine/element_forces.h"
#include "simulation/engine/integrator.h"
#include "simulation/engine/session.h"
#include "simulation/mjcf/mjcf.h"
#include "simulation/mjcf/plan.h"

namespace mbv::simulation {
namespace {

// Stick and slip where DOFs move by forces, with the corrected engine.
//
// MuJoCo's frictionloss is a soft constraint: what rests creeps, and what slides stops over many
// steps. Here its rows hold what rests, as hard as all other rows (integrator.h). Where one would
// exceed its breakaway force, MuJoCo's solver decides with soft rows who gives way, also where
// several share a load, and hard ones correct that (Integrator::RefineFriction).
// What slides feels its law (element_forces.h) with the sign of its rate fixed. The times at which
// a rate leaves that sign, or a held coordinate accelerates, are found with Runge–Kutta steps from
// the node before; multistep history starts anew there. What is over between two nodes is not seen.
//
// Where DOFs move by forces, steps end on the corners of stops and curves as well (PieceOf()):
// forces are continuous there, and a step across would lose its order.
//
// Joints of one loop stop together, but for what the scheme leaves undone in the loops. With J the
// loops and commands, G_r what rests or stops, ẋ what is commanded, G_e has the rate
//   q̇_e = G_e (v − e),  (J; G_r) e = (J v − ẋ; G_r v), e of least norm                          (1)
// in which that is taken out: what (1) leaves is motion, however large the step.
//
// A rigid stop is hit where its gap would close. With MuJoCo's M, rows J of loops and commands and
// the gradients G of what is hit or in touch
//   M Δv = Jᵀλ + Gᵀp,  J Δv = 0,  G Δv = −(1 + ε) G v where it is hit, 0 in touch               (2)
// What then stays in touch is held by a row of MuJoCo like friction at rest, and let go where that
// would pull.

class StickSlip {
 public:
  using CommandAt = std::function<RunSummary(double t_s, Commanded* at)>;
  /// All outlive the object.
  StickSlip(Session* session, Integrator* integrator, CommandAt command);

  /// True where something with dry friction, or a law with corners, moves by forces.
  [[nodiscard]] bool acts() const {
    return !s_.engine.frictions.empty() || !corners_.empty() || !branching_.empty();
  }
  /// Decides at the start, before Integrator::Start(): rates show what slides.
  void FindSliding(const Step& first);
  /// Decides what rests at the start, after Integrator::Start().
  [[nodiscard]] RunSummary Begin();
  /// Takes a step with all its events, and its work.
  [[nodiscard]] RunSummary Advance(const Step& step);
  /// Decides again where given forces have jumped or elements are switched; `next` begins there.
  [[nodiscard]] RunSummary AfterJump(const Step& next);

 private:
  struct Event {
    double after_s = 0.0;
    std::vector<size_t> stops = {};
    std::vector<std::pair<size_t, int>> starts = {};  ///< elements and signs
    std::vector<std::pair<size_t, int>> hits = {};    ///< rigid stops, and which end: 1 or −1
    std::vector<size_t> leaves = {};                  ///< of those in touch
    [[nodiscard]] bool of_stops() const { return !hits.empty() || !leaves.empty(); }
  };
  [[nodiscard]] RunSummary SwitchOver(const Step& step);
  [[nodiscard]] bool IsOff(size_t element) const {
    return std::ranges::binary_search(off_, element);
  }
  void FindDirection(size_t element);
  [[nodiscard]] RunSummary Go(double from_s, double h, bool multistep);
  [[nodiscard]] RunSummary LetGo(double t_s);
  [[nodiscard]] RunSummary Jump(double t_s);
  [[nodiscard]] RunSummary FindRates(const Event& event, double t_s);
  [[nodiscard]] RunSummary Apply(const Event& event, double t_s);
  [[nodiscard]] bool Ended() const;
  [[nodiscard]] std::vector<int> Pieces() const;
  /// True if expressions have branches.
  [[nodiscard]] bool has_branches() const { return branch_elements_ > 0 || !branching_.empty(); }
  /// Takes expressions by the branches of pieces_.
  void FixBranches();
  /// Forces have jumped with them.
  [[nodiscard]] RunSummary AfterBranch(double t_s);
  [[nodiscard]] double CornerTime(const Integrator::Node& node, double from_s, double h);
  [[nodiscard]] bool Stopped(size_t element) const;
  /// Sign of a held element's acceleration, 0 where MuJoCo holds it.
  [[nodiscard]] int Started(size_t element) const;
  [[nodiscard]] RunSummary Find(const Integrator::Node& node, double from_s, double h,
                                Event* event);
  [[nodiscard]] double StopTime(const Integrator::Node& node, size_t element, double from_s,
                                double h);
  [[nodiscard]] double StartTime(const Integrator::Node& node, size_t element, double from_s,
                                 double h, int* sign);
  [[nodiscard]] double RateAfter(const Integrator::Node& node, size_t element, double from_s,
                                 double h);
  [[nodiscard]] double Moving(size_t element) const;
  [[nodiscard]] double GapTo(size_t element, int side) const;
  [[nodiscard]] bool IsBeyond(size_t element, int side) const;
  [[nodiscard]] bool Pulls(size_t element) const;
  [[nodiscard]] RunSummary BeginStops();
  [[nodiscard]] RunSummary Strike(const std::vector<std::pair<size_t, int>>& hits, double t_s);
  [[nodiscard]] RunSummary LeaveStops(double t_s);
  /// The time from which on it holds, where it does at the end.
  template <typename Holds>
  [[nodiscard]] double TimeOf(const Integrator::Node& node, double from_s, double h,
                              const Holds& holds);
  /// Into the trace.
  void NoteEvents(double t_s);

  Session& s_;
  Integrator& integrator_;
  const CommandAt command_;
  std::vector<int> sliding_;
  std::vector<char> fresh_;  ///< slides since the present node
  std::vector<size_t> friction_elements_;
  std::vector<size_t> off_;      ///< switched off: they count as sliding, without a force
  std::vector<size_t> corners_;  ///< elements whose law has corners
  size_t branch_elements_ = 0;   ///< expressions among them
  const std::vector<BranchingFunction> branching_;
  std::vector<int> pieces_;    ///< of corners_, then of branching_, at the present node
  std::vector<double> rates_;  ///< of these, by (1)
  std::vector<std::pair<size_t, int>> ends_;  ///< of rigid stops
  std::vector<double> closed_;                ///< per end: its gap at the node where that is closed
  std::vector<int> touch_;                    ///< per element: the end in touch, or 0
  EventLog log_;
  RunSummary trouble_ = RunSummary::Done();
  int uniform_ = 4;  ///< nodes since the last event, as in Step
};

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
constexpr int kMostRounds = 40, kMostEvents = 1000;  // at one node, in one step
// A gap is open within this [characteristic lengths, rad].
constexpr double kTouches = 1e-12;

StickSlip::StickSlip(Session* session, Integrator* integrator, CommandAt command)
    : s_(*session),
      integrator_(*integrator),
      command_(std::move(command)),
      branching_(s_.motion.free() || IsReleased(s_.engine)
                     ? BranchingFunctions(*s_.engine.mechanism, s_.motion)
                     : std::vector<BranchingFunction>{}) {
  const std::vector<ForceElement>& elements = s_.engine.mechanism->elements;
  for (size_t e = 0; e < elements.size(); ++e) {
    if (HasFriction(elements[e]) && !s_.engine.elements[e].prescribed)
      friction_elements_.push_back(e);
  }
  const bool moves_by_forces = s_.motion.free() || IsReleased(s_.engine);
  for (size_t e = 0; e < elements.size() && moves_by_forces; ++e) {
    if (!IsRigidStop(elements[e])) {
      if (HasCorners(elements[e])) corners_.push_back(e);
      branch_elements_ += std::holds_alternative<ExpressionLaw>(elements[e].law) ? 1 : 0;
      continue;
    }
    const auto& stop = std::get<StopLaw>(elements[e].law);
    if (std::isfinite(stop.upper)) ends_.emplace_back(e, 1);
    if (std::isfinite(stop.lower)) ends_.emplace_back(e, -1);
  }
  touch_.assign(elements.size(), 0);
  sliding_.assign(elements.size(), 0);
  fresh_.assign(elements.size(), 0);
}

void StickSlip::FindDirection(size_t e) {
  const double rate = ElementMotionOf(s_.system, e).rate;
  const bool rests = std::abs(rate) <= kStopped * s_.engine.elements[e].rest_rate;
  sliding_[e] = IsOff(e) ? 1 : rests ? 0 : rate > 0.0 ? 1 : -1;
}

void StickSlip::FindSliding(const Step& first) {
  off_ = SwitchedOff(s_.motion, first.from_s, s_.until(first.to_s));
  for (const size_t e : friction_elements_) FindDirection(e);
  for (const auto& [e, side] : ends_) sliding_[e] = 1;
  s_.system.SetSliding(sliding_);
}

// Brakes and clutches that are switched on or off with this step.
RunSummary StickSlip::SwitchOver(const Step& step) {
  if (s_.motion.switches.empty()) return RunSummary::Done();
  std::vector<size_t> off = SwitchedOff(s_.motion, step.from_s, s_.until(step.to_s));
  return off == off_ ? RunSummary::Done() : AfterJump(step);
}

RunSummary StickSlip::Begin() {
  pieces_ = Pieces();
  FixBranches();
  RunSummary summary = LetGo(0.0);
  NoteEvents(0.0);
  if (!summary.ok() || ends_.empty()) return summary;
  summary = BeginStops();
  NoteEvents(0.0);
  return summary;
}

double StickSlip::GapTo(size_t e, int side) const {
  const auto& stop = std::get<StopLaw>(s_.engine.mechanism->elements[e].law);
  const double q = ElementMotionOf(s_.system, e).position;
  return side > 0 ? stop.upper - q : q - stop.lower;
}

bool StickSlip::IsBeyond(size_t e, int side) const {
  const Mechanism& mechanism = *s_.engine.mechanism;
  const double unit = ActsOnLength(mechanism, mechanism.elements[e]) ? s_.system.length() : 1.0;
  return touch_[e] != side && GapTo(e, side) < -kTouches * unit;
}

// Its row pushes towards larger values.
bool StickSlip::Pulls(size_t e) const {
  return touch_[e] != 0 && touch_[e] * s_.system.HeldForce(e) > 0.0;
}

// What is in touch at the start stays there or is hit; the reference refuses starts beyond an end.
RunSummary StickSlip::BeginStops() {
  std::vector<std::pair<size_t, int>> hits;
  const Mechanism& mechanism = *s_.engine.mechanism;
  for (const auto& [e, side] : ends_) {
    const double unit = ActsOnLength(mechanism, mechanism.elements[e]) ? s_.system.length() : 1.0;
    const double rate = -side * ElementMotionOf(s_.system, e).rate;
    if (GapTo(e, side) <= kTouches * unit && rate <= s_.engine.elements[e].rest_rate) {
      hits.emplace_back(e, side);
    }
  }
  if (hits.empty()) return RunSummary::Done();
  if (RunSummary summary = Strike(hits, 0.0); !summary.ok()) return summary;
  return LeaveStops(0.0);
}

// (2)
RunSummary StickSlip::Strike(const std::vector<std::pair<size_t, int>>& hits, double t_s) {
  const mjModel* m = s_.engine.m.get();
  const int nv = s_.system.nv(), rows = s_.system.rows();
  std::vector<std::pair<size_t, int>> all = hits;
  for (const auto& [e, side] : ends_) {
    if (touch_[e] == side) all.emplace_back(e, side);
  }
  RowMajor M(nv, nv);
  mj_fullM(m, M.data(), s_.data->qM);
  const VecX unit = s_.system.dof_unit(), v = Eigen::Map<const VecX>(s_.data->qvel, nv);
  const MatX scaled = unit.asDiagonal() * M * unit.asDiagonal();
  const auto count = static_cast<Eigen::Index>(all.size());
  const Eigen::Index size = nv + rows + count;
  MatX K = MatX::Zero(size, size);
  VecX change = VecX::Zero(size);
  std::vector<double> closing;
  std::vector<bool> rested;
  K.topLeftCorner(nv, nv) = scaled / scaled.diagonal().maxCoeff();
  K.block(nv, 0, rows, nv) = s_.system.ScaledJ();
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto& [e, side] = all[static_cast<size_t>(k)];
    const VecX G = -side * ElementGradient(s_.system, e).cwiseProduct(unit);
    const double largest = std::max(G.cwiseAbs().maxCoeff(), std::numeric_limits<double>::min());
    const double rate = -side * ElementMotionOf(s_.system, e).rate;
    const double rebound =
        -std::get<StopLaw>(s_.engine.mechanism->elements[e].law).restitution * rate;
    const bool is_hit = k < static_cast<Eigen::Index>(hits.size());
    const bool rests =
        !is_hit || rate >= 0.0 || std::abs(rebound) <= s_.engine.elements[e].rest_rate;
    K.block(nv + rows + k, 0, 1, nv) = G.transpose() / largest;
    change[nv + rows + k] = ((rests ? 0.0 : rebound) - rate) / largest;
    closing.push_back(is_hit ? -rate : 0.0);
    rested.push_back(is_hit && rests);
  }
  K.topRightCorner(nv, rows + count) = -K.bottomLeftCorner(rows + count, nv).transpose();
  const VecX found = Eigen::CompleteOrthogonalDecomposition<MatX>(K).solve(change);
  const VecX impulse = found.tail(count);
  for (size_t k = 0; k < all.size(); ++k) {
    const auto& [e, side] = all[k];
    const double part = impulse[static_cast<Eigen::Index>(k)];
    if (part >= -kStarts * impulse.cwiseAbs().maxCoeff()) continue;
    if (k >= hits.size()) {  // what is in touch is not pulled: without it
      touch_[e] = 0, sliding_[e] = 1;
      return Strike(hits, t_s);
    }
    if (closing[k] <= s_.engine.elements[e].rest_rate) continue;
    return {.stop = Stop::kNoConvergence,
            .message = fmt::format("rigid stop '{}' and others are hit at once, and the order is "
                                   "not determined, at t = {:.6g} s",
                                   s_.engine.mechanism->elements[e].name, t_s),
            .time_s = t_s,
            .where = s_.engine.mechanism->elements[e].name,
            .names_where = true,
            .states_time = true};
  }
  for (size_t k = 0; k < hits.size(); ++k) {
    const auto& [e, side] = hits[k];
    if (rested[k]) touch_[e] = side, sliding_[e] = 0;
    if (closing[k] <= s_.engine.elements[e].rest_rate) continue;
    log_.Add(s_.engine.mechanism->elements[e], t_s,
             side > 0 ? Happening::kHitsUpper : Happening::kHitsLower);
  }
  const VecX dv = found.head(nv).cwiseProduct(unit);
  s_.work.Add(0.5 * ((v + dv).dot(M * (v + dv)) - v.dot(M * v)));
  integrator_.Strike(dv);
  return Jump(t_s);
}

// Those that would pull are let go; what is in touch and accelerates away, too.
RunSummary StickSlip::LeaveStops(double t_s) {
  for (int pass = 0; pass < kMostRounds; ++pass) {
    bool changed = false;
    for (const auto& [e, side] : ends_) {
      if (touch_[e] != side || !Pulls(e)) continue;
      touch_[e] = 0, sliding_[e] = 1;
      changed = true;
    }
    if (!changed) return RunSummary::Done();
    if (RunSummary summary = Jump(t_s); !summary.ok()) return summary;
  }
  return RunSummary::Done();
}

template <typename Holds>
double StickSlip::TimeOf(const Integrator::Node& node, double from_s, double h,
                         const Holds& holds) {
  double before = 0.0, beyond = h;
  for (int i = 0; i < kHalvings; ++i) {
    const double t = 0.5 * (before + beyond);
    integrator_.Restore(node);
    if (RunSummary summary = Go(from_s, t, false); !summary.ok()) trouble_ = summary;
    (holds() ? beyond : before) = t;
  }
  return beyond;
}

void StickSlip::NoteEvents(double t_s) {
  const std::vector<ForceElement>& elements = s_.engine.mechanism->elements;
  for (const size_t e : friction_elements_) {
    log_.Note(elements[e], t_s, IsOff(e) ? Happening::kSwitchedOff : HappeningAt(sliding_[e]));
  }
  for (size_t k = 0; k < corners_.size(); ++k) {
    const ForceElement& element = elements[corners_[k]];
    log_.Note(element, t_s, HappeningOn(element, pieces_[k]), pieces_[k]);
  }
  for (size_t k = 0; k < branching_.size(); ++k) {
    log_.Note(branching_[k].path, t_s, Happening::kBranch, pieces_[corners_.size() + k]);
  }
  for (const auto& [e, side] : ends_) {
    log_.Note(elements[e], t_s,
              touch_[e] == 0  ? Happening::kFree
              : touch_[e] > 0 ? Happening::kUpperEnd
                              : Happening::kLowerEnd);
  }
  std::vector<MotionEvent>& events = s_.run->trace.events;
  events.insert(events.end(), log_.events().begin() + static_cast<long>(events.size()),
                log_.events().end());
}

std::vector<int> StickSlip::Pieces() const {
  std::vector<int> pieces;
  for (const size_t e : corners_) {
    const ElementMotion at = ElementMotionOf(s_.system, e);
    pieces.push_back(PieceOf(s_.engine.mechanism->elements[e], at.position, at.rate));
  }
  if (!branching_.empty()) {
    const std::vector<int> branches = s_.loads.Branches();
    pieces.insert(pieces.end(), branches.begin(), branches.end());
  }
  return pieces;
}

void StickSlip::FixBranches() {
  if (!has_branches()) return;
  std::vector<int> of_elements(s_.engine.mechanism->elements.size(), kAnyBranch);
  for (size_t k = 0; k < corners_.size(); ++k) {
    const size_t e = corners_[k];
    if (std::holds_alternative<ExpressionLaw>(s_.engine.mechanism->elements[e].law)) {
      of_elements[e] = pieces_[k];
    }
  }
  s_.system.SetBranches(std::move(of_elements));
  s_.loads.FixBranches({pieces_.begin() + static_cast<long>(corners_.size()), pieces_.end()});
}

RunSummary StickSlip::AfterBranch(double t_s) {
  FixBranches();
  if (RunSummary summary = Jump(t_s); !summary.ok()) return summary;
  if (RunSummary summary = LetGo(t_s); !summary.ok()) return summary;
  if (RunSummary summary = LeaveStops(t_s); !summary.ok()) return summary;
  s_.work.Jump(s_.WorkRates());
  return RunSummary::Done();
}

// The first time found beyond which some law is on another piece, where one is at the end.
double StickSlip::CornerTime(const Integrator::Node& node, double from_s, double h) {
  return TimeOf(node, from_s, h, [this] { return Pieces() != pieces_; });
}

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
  return !IsOff(element) && sliding_[element] * ElementMotionOf(s_.system, element).rate < 0.0;
}

int StickSlip::Started(size_t element) const {
  if (sliding_[element] != 0) return 0;
  const double acceleration = ElementMotionOf(s_.system, element).acceleration;
  if (std::abs(acceleration) <= Moving(element)) return 0;
  return acceleration > 0.0 ? 1 : -1;
}

bool StickSlip::Ended() const {
  const auto ends_here = [this](const auto& end) {
    return IsBeyond(end.first, end.second) || Pulls(end.first);
  };
  return Pieces() != pieces_ || std::ranges::any_of(ends_, ends_here) ||
         std::ranges::any_of(friction_elements_,
                             [this](size_t e) { return Stopped(e) || Started(e) != 0; });
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

RunSummary StickSlip::AfterJump(const Step& next) {
  const std::vector<size_t> before = off_;
  off_ = SwitchedOff(s_.motion, next.from_s, s_.until(next.to_s));
  for (const size_t e : friction_elements_) {
    if (IsOff(e) != std::ranges::binary_search(before, e)) FindDirection(e);
  }
  if (RunSummary summary = Jump(next.from_s); !summary.ok()) return summary;
  if (has_branches()) {  // a signal that jumps may decide, too
    pieces_ = Pieces();
    FixBranches();
    if (RunSummary summary = Jump(next.from_s); !summary.ok()) return summary;
  }
  if (RunSummary summary = LetGo(next.from_s); !summary.ok()) return summary;
  if (RunSummary summary = LeaveStops(next.from_s); !summary.ok()) return summary;
  NoteEvents(next.from_s);
  s_.work.Jump(s_.WorkRates());
  uniform_ = 0;
  return RunSummary::Done();
}

// What MuJoCo does not hold slides from here on; that may set others free.
RunSummary StickSlip::LetGo(double t_s) {
  for (int pass = 0; pass < kMostRounds; ++pass) {
    bool changed = false;
    for (const size_t e : friction_elements_) {
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
          .time_s = t_s};
}

// (1)
RunSummary StickSlip::FindRates(const Event& event, double t_s) {
  Commanded at;
  if (RunSummary summary = command_(t_s, &at); !summary.ok()) return summary;
  const ConstraintSystem& system = s_.system;
  const auto rests = [&](size_t e) {
    return sliding_[e] == 0 || std::ranges::find(event.stops, e) != event.stops.end();
  };
  const Eigen::Index rows = system.rows(),
                     resting = std::ranges::count_if(friction_elements_, rests);
  const Eigen::Map<const VecX> v(s_.data->qvel, system.nv());
  MatX S(rows + resting, system.nv());
  VecX missed(rows + resting);
  S.topRows(rows) = system.ScaledJ();
  missed.head(rows) = system.J() * v;
  system.AddPrescribed(-1.0, at.motion.velocity, &missed);
  missed.head(rows) = missed.head(rows).cwiseQuotient(system.row_unit());
  Eigen::Index row = rows;
  for (const size_t e : friction_elements_) {
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
  rates_.resize(friction_elements_.size());
  for (size_t k = 0; k < friction_elements_.size(); ++k) {
    const size_t e = friction_elements_[k];
    rates_[k] = ElementMotionOf(system, e).rate - ElementGradient(system, e).dot(error);
  }
  return RunSummary::Done();
}

// What comes to rest with the event, and what starts there.
RunSummary StickSlip::Apply(const Event& event, double t_s) {
  if (!event.stops.empty()) {
    if (RunSummary summary = FindRates(event, t_s); !summary.ok()) return summary;
    for (size_t k = 0; k < friction_elements_.size(); ++k) {
      const size_t e = friction_elements_[k];
      const bool stops = std::ranges::find(event.stops, e) != event.stops.end();
      const bool slow = std::abs(rates_[k]) <= kStopped * s_.engine.elements[e].rest_rate;
      if (stops || (slow && fresh_[e] == 0 && !IsOff(e))) sliding_[e] = 0;
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
  for (const size_t e : friction_elements_) {
    if (Stopped(e)) stopped.push_back(e);
    if (Started(e) != 0) started.push_back(e);
  }
  std::vector<std::pair<size_t, int>> hit, pulling;
  for (const auto& [e, side] : ends_) {
    if (IsBeyond(e, side)) hit.emplace_back(e, side);
    if (touch_[e] == side && Pulls(e)) pulling.emplace_back(e, side);
  }
  event->after_s = 2.0 * h;
  trouble_ = RunSummary::Done();
  if (Pieces() != pieces_) event->after_s = CornerTime(node, from_s, h);
  for (const size_t e : stopped) {
    const double at = StopTime(node, e, from_s, h);
    if (at < event->after_s) *event = {.after_s = at, .stops = {e}};
  }
  for (const size_t e : started) {
    int sign = 0;
    const double at = StartTime(node, e, from_s, h, &sign);
    if (at > event->after_s) continue;
    if (at < event->after_s) *event = {.after_s = at};
    if (sign != 0) event->starts.emplace_back(e, sign);
  }
  // Where it was hit last, the gap is closed but for round-off.
  for (size_t k = 0; k < ends_.size(); ++k) {
    const auto& [e, side] = ends_[k];
    if (std::ranges::find(hit, ends_[k]) == hit.end()) continue;
    const double at =
        TimeOf(node, from_s, h, [&, of = e, to = side] { return GapTo(of, to) < closed_[k]; });
    if (at > event->after_s) continue;
    if (at < event->after_s) *event = {.after_s = at};
    event->hits.emplace_back(e, side);
  }
  for (const auto& [e, side] : pulling) {
    const double at = TimeOf(node, from_s, h, [&, of = e] { return Pulls(of); });
    if (at < event->after_s) *event = {.after_s = at, .leaves = {e}};
  }
  return trouble_;
}

RunSummary StickSlip::Advance(const Step& step) {
  if (RunSummary summary = SwitchOver(step); !summary.ok()) return summary;
  double from = step.from_s;
  for (int events = 0; events < kMostEvents; ++events) {
    const double h = step.to_s - from;
    const bool whole = from == step.from_s;
    const bool multistep = whole && std::min(step.uniform, uniform_) == 4;
    const Integrator::Node node = integrator_.Save();
    closed_.clear();
    for (const auto& [e, side] : ends_) closed_.push_back(std::min(0.0, GapTo(e, side)));
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
    std::vector<int> pieces = Pieces();
    const bool branches = has_branches() && pieces != pieces_;
    pieces_ = std::move(pieces);
    if (branches) {
      if (RunSummary summary = AfterBranch(from); !summary.ok()) return summary;
    }
    if (event.of_stops()) {
      for (const size_t e : event.leaves) touch_[e] = 0, sliding_[e] = 1;
      RunSummary summary = event.hits.empty() ? Jump(from) : Strike(event.hits, from);
      if (summary.ok()) summary = LeaveStops(from);
      if (!summary.ok()) return summary;
      NoteEvents(from);
      s_.work.Jump(s_.WorkRates());
      uniform_ = 0;
      continue;
    }
    if (event.stops.empty() && event.starts.empty()) {  // forces go on at a corner
      NoteEvents(from);
      uniform_ = 0;
      continue;
    }
    if (RunSummary summary = Apply(event, from); !summary.ok()) return summary;
    if (RunSummary summary = Jump(from); !summary.ok()) return summary;
    if (RunSummary summary = LetGo(from); !summary.ok()) return summary;
    NoteEvents(from);
    s_.work.Jump(s_.WorkRates());
    uniform_ = 0;
  }
  return {.stop = Stop::kNoConvergence,
          .message = fmt::format("{} again and again at t = {:.6g} s",
                                 has_branches()  ? "expressions change between branches"
                                 : ends_.empty() ? "friction starts and stops"
                                                 : "rigid stops are hit",
                                 from),
          .time_s = from,
          .states_time = true};
}

}  // namespace
namespace {

// A closure open by more than this part of the mechanism's extent has come apart.
constexpr double kApart = 0.01;

RunSummary Diverged(Session* s, const std::string& what, double t_s) {
  s->diverged = true;
  return {.stop = Stop::kEngineFailure,
          .message = fmt::format("{} at t = {:.6g} s", what, t_s),
          .time_s = t_s,
          .states_time = true};
}

// Home to the first driven sample, with consistent velocities and accelerations.
RunSummary PutAtStart(Session* s, const DrivenSample& first) {
  if (s->motion.free()) return PutAtFreeStart(s, first);
  if (!PrescribesMotion(s->options.mode)) return PutAtCommandedStart(s, first);
  if (RunSummary summary = CloseAtStart(s->motion, first, &s->system, &s->solver, &s->run->notes);
      !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  if (RunSummary summary = s->spins.TakeLeastTurns(&s->solver, first); !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  s->solver.SolveVelocity(first.velocity);
  s->spins.StopVelocity();
  s->solver.SolveAcceleration(first.acceleration);
  s->spins.StopAcceleration();
  return RunSummary::Done();
}

// A number rounded down to one digit.
double Rounded(double x) {
  const double digit = std::pow(10.0, std::floor(std::log10(x)));
  return digit * std::floor(x / digit);
}

// Springs, dampers and servos against the step: a coarse step is reported, one that cannot follow
// them is refused before it gives numbers.
RunSummary CheckStep(Session* s) {
  const FastestRate fastest = FastestRateOf(s->system, s->options.servo, s->motion.duration_s);
  const double h = AdjustedStep(s->motion, s->options.step_s);
  const double per_period = 2.0 * std::numbers::pi / (fastest.per_s * h);
  if (fastest.per_s > 0.0 && per_period < kLeastStepsPerPeriod) {
    const double wanted_s = Rounded(0.2 / fastest.per_s);
    return {
        .stop = Stop::kEngineFailure,
        .message = fmt::format("{} has a rate of {:.3g} rad/s at the start, which a step of {:g} "
                               "s cannot follow: simulation.step_s = {:.1g} or less is needed",
                               fastest.part, fastest.per_s, h, wanted_s),
        .time_s = 0.0,
        .where = fastest.part,
        .amount = wanted_s,
        .unit = "s",
        .names_where = true};
  }
  const double drift = fastest.drift * std::pow(h, 4);
  if (drift <= kMostDrift) return RunSummary::Done();
  s->run->notes.push_back(fmt::format(
      "{} vibrates at {:.3g} rad/s at the start: with a step of {:g} s that drifts by about {:.0e} "
      "of its amplitude; simulation.step_s = {:.1g} or less is needed",
      fastest.drift_part, fastest.drift_per_s, h, drift,
      Rounded(h * std::pow(kMostDrift / drift, 0.25))));
  return RunSummary::Done();
}

// Of what was recorded.
RunSummary TroubleAt(const Session& s, double t_s) {
  if (!s.loads.trouble().ok()) return s.loads.trouble();
  RunSummary summary = s.trouble;
  if (!summary.ok()) summary.time_s = t_s;
  return summary;
}

// After a recorded sample: the motion must be finite and the loops closed.
RunSummary CheckSample(Session* s, double largest_gap_m, double t_s) {
  if (!s->loads.trouble().ok()) return s->loads.trouble();
  const ConstraintSystem::Gap gap = s->system.LargestGap();
  if (gap.position_m < largest_gap_m) return TroubleAt(*s, t_s);
  return Diverged(
      s, fmt::format("loop-closure error of {:.3g} m in the simulation", gap.position_m), t_s);
}

}  // namespace

RunSummary RunCorrected(Session* s, const DrivenMotion& driven) {
  const std::vector<Step> steps = MakeSteps(s->motion, s->options.step_s);
  // What is commanded is evaluated before the loop.
  const auto command = [&](double t_s, Commanded* at) {
    RunSummary summary = driven(t_s, &at->motion);
    return summary.ok() && s->options.forces ? s->options.forces(s->until(t_s), &at->force)
                                             : summary;
  };
  std::vector<Commanded> ends(steps.size()), middles(steps.size());
  Commanded first;
  if (RunSummary summary = command(0.0, &first); !summary.ok()) return summary;
  for (size_t i = 0; i < steps.size(); ++i) {
    s->until.StartFrom(steps[i].from_s);
    if (steps[i].uniform < 4) {
      const double middle = 0.5 * (steps[i].from_s + steps[i].to_s);
      if (RunSummary summary = command(middle, &middles[i]); !summary.ok()) return summary;
    }
    if (RunSummary summary = command(steps[i].to_s, &ends[i]); !summary.ok()) return summary;
  }
  s->until.StartFrom(0.0);
  if (RunSummary summary = PutAtStart(s, first.motion); !summary.ok()) return summary;
  if (RunSummary summary = CheckStep(s); !summary.ok()) return summary;
  const double largest_gap = kApart * mjcf::Extent(*s->engine.mechanism);
  Integrator integrator(s, AdjustedStep(s->motion, s->options.step_s));
  StickSlip friction(s, &integrator, command);
  const LoopClock clock;
  if (friction.acts() && !steps.empty()) friction.FindSliding(steps.front());
  integrator.Start(first);
  s->FindShared();
  s->work.Start(s->WorkRates());
  if (friction.acts()) {
    if (RunSummary summary = friction.Begin(); !summary.ok()) return summary;
    s->work.Jump(s->WorkRates());
  }
  s->Record(0);
  if (RunSummary summary = TroubleAt(*s, 0.0); !summary.ok()) return summary;
  for (size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const double h = step.to_s - step.from_s;
    if (friction.acts()) {
      if (RunSummary summary = friction.Advance(step); !summary.ok()) return summary;
    } else if (step.uniform == 4) {
      integrator.MultiStep(h, ends[i], step.to_s);
    } else {
      integrator.RungeKutta(h, middles[i], ends[i], step.from_s);
    }
    if (!s->loads.trouble().ok()) return s->loads.trouble();
    if (!integrator.healthy()) return Diverged(s, "the simulated motion diverged", step.to_s);
    if (!friction.acts()) s->work.Step(h, step.uniform == 4, s->WorkRates());
    s->until.StartFrom(step.to_s);
    if (s->until.IsJump(step.to_s)) {
      Commanded after;
      RunSummary summary = command(step.to_s, &after);
      if (summary.ok() && friction.acts()) {
        summary = friction.AfterJump(i + 1 < steps.size() ? steps[i + 1]
                                                          : Step{step.to_s, step.to_s + h});
      } else if (summary.ok()) {
        integrator.EvaluateAgain(after, step.to_s);
        s->work.Jump(s->WorkRates());
      }
      if (!summary.ok()) return summary;
    }
    if (step.sample < 0) continue;
    s->Record(static_cast<size_t>(step.sample));
    if (RunSummary summary = CheckSample(s, largest_gap, step.to_s); !summary.ok()) return summary;
  }
  clock.Stop(s->run);
  s->run->steps = static_cast<long>(steps.size());
  return RunSummary::Done();
}

void TargetsWithRates(const DrivenSample& at, double time_constant_s, VecX* targets) {
  const double d = kMjcfImpedance, tc = time_constant_s;
  const double b = 2.0 / (d * tc), k_d = d / (d * d * tc * tc);
  *targets = at.position + (b * at.velocity + at.acceleration) / k_d;
}

RunSummary RunStock(Session* s, const DrivenMotion& driven) {
  const double h = AdjustedStep(s->motion, s->options.step_s);
  const std::vector<double>& times = s->run->trace.time_s;
  const long per_sample = std::lround(s->motion.sample_s / h);
  const long last = static_cast<long>(times.size() - 1) * per_sample;
  std::vector<DrivenSample> samples(static_cast<size_t>(last + 1));
  for (long n = 0; n <= last; ++n) {
    if (RunSummary summary = driven(static_cast<double>(n) * h, &samples[n]); !summary.ok()) {
      return summary;
    }
  }
  if (RunSummary summary = PutAtStart(s, samples[0]); !summary.ok()) return summary;
  if (RunSummary summary = CheckStep(s); !summary.ok()) return summary;
  const bool rates = s->options.engine == Engine::kStock;
  const double tc = s->options.stock_time_constant_steps * h;
  s->FindShared();
  const mjModel* m = s->engine.m.get();
  mjData* data = s->data.get();
  VecX targets;
  const LoopClock clock;
  for (long n = 0; n <= last; ++n) {
    const DrivenSample& at = samples[n];
    targets = at.position;
    if (rates) TargetsWithRates(at, tc, &targets);
    s->SetPayloads(static_cast<double>(n) * h);
    s->system.SetTargets(targets);
    if (s->system.has_given_forces() || s->lacking || s->loads.follow()) {
      s->system.EvaluatePosition();
      mj_comVel(m, data);
    }
    s->ApplyForces(static_cast<double>(n) * h, {.motion = at, .force = {}});
    if (!s->loads.trouble().ok()) return s->loads.trouble();
    if (n % per_sample == 0) {
      mj_forward(m, data);
      s->system.TakeJacobian();
      s->Record(static_cast<size_t>(n / per_sample));
      if (RunSummary summary = TroubleAt(*s, static_cast<double>(n) * h); !summary.ok()) {
        return summary;
      }
    }
    {
      const OwnJacobians jacobians(s->engine);
      mj_step(m, data);
    }
    if (data->warning[mjWARN_BADQACC].number > 0 || data->warning[mjWARN_BADQPOS].number > 0 ||
        data->warning[mjWARN_BADQVEL].number > 0) {
      return Diverged(s, "MuJoCo reset the simulation, which had diverged",
                      static_cast<double>(n) * h);
    }
  }
  clock.Stop(s->run);
  s->run->steps = last;
  return RunSummary::Done();
}

}  // namespace mbv::simulation
