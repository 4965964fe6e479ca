// Integration of a free motion from sample to sample. Internal to reference/.
//
// Runge–Kutta of orders 8(7) between the times where forces, loads or commands break. Where the
// loops lose a constraint for an instant, the equations of motion divide by zero although the
// motion itself goes on smoothly [Bayo, Avello 1994]. Shortly before such a pose the motion is
// continued by the polynomial through states and rates of the last nodes to the mirror time behind
// it, put back onto loops and commands, and integrated on from there. The bridge holds only if the
// loops are closed and the energy balances at its end, and its rates are those of the dynamics;
// otherwise the integration goes on step by step and ends at the pose.
//
// Dry friction (free_friction.cc): while every element slides in one direction or sticks, the
// equations are smooth. After each step the rates of what slides and the load of what sticks
// (rest_decision.h) are looked at, also within the step; where one passes its bound, the same
// scheme with shorter steps brackets that time to round-off, and the motion goes on from there. At
// a dead centre a coordinate is at rest although the DOFs are not: it turns, and is never held.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "kinematics/constraints.h"
#include "mechanism/event_log.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/forward.h"
#include "reference/free_dynamics.h"

namespace mbv::internal {

/// How long an integration may take, and where its progress is reported.
struct Effort {
  long most_steps = 0;                                 ///< tried ones included
  std::function<void(double fraction)> progress = {};  ///< of the motion's duration; may be empty
};

/// At t, the cubic with given values and derivatives at 0 and h.
[[nodiscard]] double Cubic(double h, double t, double v0, double a0, double v1, double a1);

class FreeMotion {
 public:
  /// Mechanism and motion outlive the object. Steps are at most `largest_step_s`.
  FreeMotion(const Mechanism& mechanism, const Motion& motion, double tolerance,
             double largest_step_s, Effort effort);
  ~FreeMotion();

  /// Puts `states` onto loops and commands at t = 0 and starts there.
  [[nodiscard]] RunSummary Start(const BodyStates& states);
  /// Integrates to `t_s`; states() then has accelerations too.
  [[nodiscard]] RunSummary AdvanceTo(double t_s);

  [[nodiscard]] const BodyStates& states() const { return on_bridge_ ? sampled_ : now_.states; }
  /// Work since the start, as WorkChannels().
  [[nodiscard]] const VecX& work() const { return on_bridge_ ? sampled_work_ : now_.work; }
  [[nodiscard]] FreeDynamics& dynamics() { return dynamics_; }
  [[nodiscard]] const std::vector<MotionEvent>& events() const { return log_.events(); }
  [[nodiscard]] long steps() const { return steps_; }
  [[nodiscard]] long evaluations() const { return evaluations_; }
  /// Crossings found so far, in time order.
  [[nodiscard]] std::vector<SingularityCrossing> Crossings() const;

 private:
  using State = std::vector<double>;
  static constexpr size_t kPerBody = 13;  ///< position, quaternion (w, x, y, z), twist
  /// A pose counts as near singular while its pivot is below this share of the largest of the run.
  static constexpr double kNear = 0.03;
  // A node of the integration.
  struct Node {
    double time_s = 0.0;
    double pivot = kNan;
    BodyStates states;
    VecX work;
  };
  struct Bridge {
    double from_s = 0.0, to_s = 0.0;
    Hermite way;
  };

  // What is integrated has no units but radians and seconds, so that the tolerance means the same
  // for mechanisms of any size and anywhere: positions are displacements since the start in
  // characteristic lengths L, work is in M L²/s² with the mass M of all bodies.
  [[nodiscard]] State Pack(const Node& node) const;
  void Unpack(const State& x, BodyStates* states, VecX* work) const;
  [[nodiscard]] RunSummary Accelerate(double t_s, BodyStates* states);
  void Rates(const State& x, State* rates, double t_s);
  [[nodiscard]] RunSummary Segment(double to_s);
  [[nodiscard]] RunSummary Accept(const State& x, double t_s);
  /// Of the laws with corners (PieceOf()), in the order of corner_elements_.
  [[nodiscard]] std::vector<int> PiecesAt(const State& x) const;
  // Expressions are taken by the branch on which a step begins, until they leave it.
  [[nodiscard]] bool has_branches() const {
    return !branch_elements_.empty() || !branching_.empty();
  }
  /// As BodyStates::branches, of those that hold there.
  [[nodiscard]] std::vector<int> BranchesAt(const State& x, double t_s) const;
  /// The time just beyond which another branch holds; h where none does.
  struct BranchEnd {
    double after_s = 0.0;
    std::vector<int> next = {};
  };
  [[nodiscard]] BranchEnd TimeToBranch(double h, const State& to);
  [[nodiscard]] RunSummary TakeBranches(std::vector<int> branches);
  [[nodiscard]] double TimeToCorner(double h, const State& to);
  /// Where `stays(state, time after now)` does not hold at h: a time just beyond which it does not,
  /// 0 where that is at once; h where no step leads there.
  template <typename Stays>
  [[nodiscard]] double TimeOfChange(double h, const Stays& stays);
  void NoteFriction();
  void NoteCorners();
  [[nodiscard]] RunSummary SampleBridge(double t_s);
  /// Time to the singular pose ahead, if the weakest pivot goes on as between the last two nodes.
  [[nodiscard]] double TimeToSingular() const;
  void TryBridge();
  [[nodiscard]] std::optional<Hermite> WayOn(double gap_s);
  [[nodiscard]] bool Land(const Hermite& way, double at_s, Node* node);
  [[nodiscard]] bool RatesFit(const Hermite& way, double t_s, double to_s, double kinetic);
  void Watch();
  [[nodiscard]] bool Passes(const SingularityCrossing& crossing) const;

  // What ends a phase of friction: some elements come to rest, or what is held starts.
  struct FrictionEvent {
    double after_s = 0.0;
    std::vector<size_t> stops = {};
    bool starts = false;
  };
  [[nodiscard]] RunSummary BeginFriction();
  /// Brakes and clutches that are switched on or off from now until then.
  [[nodiscard]] RunSummary SwitchFriction(double to_s);
  [[nodiscard]] RunSummary CheckFriction();
  [[nodiscard]] RunSummary AcceptWithFriction(const State& x, double t_s, double tried_s);
  [[nodiscard]] std::optional<FrictionEvent> FirstEvent(const State& from, double h,
                                                        const State& to);
  void FindStops(const State& from, double h, const State& to, FrictionEvent* first);
  void FindStart(const State& from, double h, const State& to, FrictionEvent* first);
  [[nodiscard]] bool AtDeadCentre(const ScalarRow& row) const;
  [[nodiscard]] bool Rests(size_t element, const ScalarRow& row) const;
  [[nodiscard]] std::vector<size_t> PrescribedElements();
  [[nodiscard]] RunSummary LeaveDeadCentres(FrictionPhase* resting);
  void FollowDeadCentres();
  [[nodiscard]] bool PassesThrough(const FrictionPhase& resting,
                                   const std::vector<size_t>& stopping);
  [[nodiscard]] RunSummary DecideResting(const FrictionPhase& next, bool starts, double h);
  [[nodiscard]] RunSummary Settle(const FrictionEvent& event, double h);
  [[nodiscard]] FrictionPhase RestingPhase(const FrictionEvent& event);
  [[nodiscard]] std::vector<int> Starting(double t_s, const BodyStates& states,
                                          RunSummary* trouble);
  [[nodiscard]] RunSummary Contradiction(size_t element, const std::string& what, double amount,
                                         const std::string& unit) const;
  [[nodiscard]] State StepFrom(const State& from, double h);
  [[nodiscard]] VecX ElementRates(const BodyStates& states) const;
  /// Rates that the integration does not distinguish from zero.
  [[nodiscard]] double Resolved(size_t element) const;
  // An end of a rigid stop: the upper one (1) or the lower one (−1), and the way to it.
  struct End {
    size_t element = 0;
    int side = 1;
  };
  struct Gap {
    double way = 0.0, rate = 0.0;  // [m or rad, per second]
  };
  // What is hit, or, of what is in touch, what would be pulled.
  struct ImpactEvent {
    double after_s = 0.0;
    std::vector<End> hits = {}, leaves = {};
  };
  void FindEnds();
  [[nodiscard]] Gap GapOf(const End& end, const BodyStates& states) const;
  [[nodiscard]] double Touches(const End& end) const;
  [[nodiscard]] bool IsInTouch(const End& end) const;
  [[nodiscard]] RunSummary StartStops();
  [[nodiscard]] std::optional<ImpactEvent> FirstImpact(double h, const State& to);
  [[nodiscard]] VecX TouchForces() const;
  void HoldTouch();
  [[nodiscard]] RunSummary KeepInTouch(std::vector<End> may_stay);
  [[nodiscard]] RunSummary LetGo(const std::vector<End>& leaves);
  [[nodiscard]] RunSummary Strike(const std::vector<End>& hits);
  [[nodiscard]] BodyStates StatesOf(const State& x) const;
  [[nodiscard]] RunSummary NoWayOn(double dt_s);
  struct LoadJump {
    std::string part, unit;
    double before = 0.0, after = 0.0;
  };
  /// Force and moment [N, N m] of every load a step of h on from now_, then given drive forces,
  /// then those of elements that are expressions.
  [[nodiscard]] VecX LoadsAfter(double h);
  /// What of these changes at once about now_.
  [[nodiscard]] std::optional<LoadJump> JumpHere();
  [[nodiscard]] RunSummary TooManySteps() const;
  /// Every this many steps: whether the springs let the rest be done with the steps that are left.
  [[nodiscard]] RunSummary LookAhead();
  template <typename StatesAt>
  [[nodiscard]] SingularityCrossing Closest(double first_s, double last_s,
                                            const StatesAt& states_at);

  struct Stepper;
  const Mechanism& mechanism_;
  const Motion& motion_;
  const double duration_s_, largest_step_s_;
  const Effort effort_;
  FreeDynamics dynamics_;
  double work_unit_ = 1.0;     ///< [J]
  std::vector<Vec3> start_W_;  ///< body origins at the start
  std::unique_ptr<Stepper> stepper_;
  std::vector<double> breaks_;
  UntilJump time_;          ///< at which forces are evaluated
  std::deque<Node> nodes_;  ///< before now_, since the last break or bridge
  Node now_;
  std::optional<Bridge> bridge_;
  bool on_bridge_ = false;
  BodyStates sampled_;  ///< on the bridge
  VecX sampled_work_;
  double dt_ = 0.0;
  BodyStates work_states_;
  RunSummary trouble_;  ///< of the last Rates()
  long steps_ = 0, tried_steps_ = 0, evaluations_ = 0;
  double looked_s_ = 0.0;  ///< time of the last LookAhead()
  double largest_pivot_ = 0.0;
  std::vector<SingularityCrossing> crossings_;
  const double tolerance_;
  std::vector<size_t> friction_elements_;  ///< with dry friction that is not switched off
  std::vector<size_t> all_friction_;       ///< with those that are
  std::vector<size_t> off_;
  std::vector<size_t> corner_elements_, branch_elements_;
  const std::vector<BranchingFunction> branching_;
  std::vector<char> fresh_;           ///< per element: slides since this very time
  std::vector<End> ends_, in_touch_;  ///< of rigid stops; in touch: by increasing elements
  int impacts_here_ = 0;              ///< since the last sample
  EventLog log_;
  int settled_here_ = 0;   ///< how often friction was decided at this very time
  int branched_here_ = 0;  ///< how often branches were left at this very time
};

// How fast springs, dampers and force elements let a mechanism vibrate or creep, and what following
// that costs. Internal to reference/.
//
// With R the motions that all constraints leave, small motions V = R x obey
//   RᵀMR ẍ + RᵀCR ẋ + RᵀKR x = 0,  K = Σ k u uᵀ, C = Σ c u uᵀ  (u: gradient of a part's coordinate)
// and the rates are |λ| of [0 I; −(RᵀMR)⁻¹RᵀKR −(RᵀMR)⁻¹RᵀCR]. Geometric stiffness is left out.

/// The fastest of a mechanism's spring modes.
struct SpringMode {
  double rate_per_s = 0.0;   ///< |λ|; 0 without springs, or where nothing is free
  double decay_per_s = 0.0;  ///< −Re λ: the amplitude falls as exp(−decay t)
  std::string spring;        ///< or force element that has most of its energy
};

/// At a pose; `motions` (6·bodies × DOFs) is a basis of what the constraints leave there.
[[nodiscard]] SpringMode FastestSpringMode(const Mechanism& mechanism, const BodyStates& states,
                                           const MatX& motions);

/// Steps that an error-controlled integration of order 7(8) needs to follow the mode for `ahead_s`
/// when its steps are `step_s` now: they cover a fixed angle while the mode rings, and grow by the
/// seventh root as it fades, until they are as long as is stable. 0 where it is not the mode that
/// makes the steps short.
[[nodiscard]] double StepsToFollow(const SpringMode& mode, double step_s, double ahead_s);

}  // namespace mbv::internal
