// Forward integration of MuJoCo's accelerations with fourth order, one evaluation per step.
//
// At every node MuJoCo computes accelerations and constraint forces from position, velocity and
// commanded motion at that very time. What 2.2.2 leaves out of its constraint rows is supplied
// between its velocity and its constraint stage:
//   aref = ẍ_ref − J̇q̇ − b (J q̇ − ẋ_ref) − k r + R f̂,   b = 2/tc, k = 1/tc²                   (1)
// (closures: ẍ_ref = ẋ_ref = 0). R, the softness of MuJoCo's constraints, is lowered beyond the
// bound that the impedance limit sets, and the force f̂ expected from the last nodes cancels what
// is left of it. With A = J M⁻¹ Jᵀ the share ρ of (A + R)⁻¹R in an expected force comes back in the
// force found: it is nothing but where many loops in a row hardly resist, A ~ 1/loops⁴. Forces
// expected by the cubic through four nodes grow from node to node where ρ > 1/5, whatever the step:
// at the start R is made so small that ρ is far below. Between nodes:
//   predictor  v* = v_n + h/24 (55 a_n − 59 a_{n−1} + 37 a_{n−2} − 9 a_{n−3}) (2)
//              q* = q_n ⊕ (h v_n + h²/360 (323 a_n − 264 a_{n−1} + 159 a_{n−2} − 38 a_{n−3})) (3)
//   evaluate   a_{n+1}, f_{n+1} at (q*, v*): the state that is recorded
//   corrector  v_{n+1} = v_n + h/24 (9 a_{n+1} + 19 a_n − 5 a_{n−1} + a_{n−2}) (4)
//              q_{n+1} = q_n ⊕ (h v_n + h²/360 (38 a_{n+1} + 171 a_n − 36 a_{n−1} + 7 a_{n−2})) (5)
// [Hairer, Nørsett, Wanner 1993, III.1 and III.10].
//
// Friction by the joints' loads and the moments of carried rotors follow accelerations and forces
// of the very same node: MuJoCo solves again until they no longer change.
//
// Where a free motion passes a pose at which a constraint is lost, constraint forces divide by zero
// although the accelerations go on smoothly. At the nodes next to such a pose (a pivot of J below
// kWeak of its largest) they are extrapolated by the polynomial through the last n ≤ 6 nodes,
//   a_{n+1} = Σ_i (−1)^{i+1} C(n, i) a_{n+1−i},                                               (6)
// and the forces are those of least norm that belong to them.
// The classical Runge–Kutta method builds up the history at the start and after every break of the
// commanded profiles. Its stages lie off the path by h²; pulled back from there, at a rate that
// rises with 1/h, they would leave a velocity error of h². So b (J q̇ − ẋ_ref) + k r of the step's
// first node serves all of its stages. Rotation vectors of balls
// and free bodies follow u̇ = ω + ½ u × ω + 1/12 u × (u × ω) [Iserles et al. 2000, Eq. 2.42].
#pragma once

#include <array>
#include <numbers>
#include <string>

#include "simulation/engine/constraint_system.h"
#include "simulation/engine/session.h"
#include "simulation/engine/simulation.h"

namespace mbv::simulation {

class Integrator {
 public:
  /// Starts from the data's qpos and qvel, with qacc as a first guess. `h`: the uniform step [s].
  Integrator(Session* session, double h);

  /// Evaluates the first node, t = 0.
  void Start(const Commanded& first);
  /// One evaluation; needs four uniform nodes behind it.
  void MultiStep(double h, const Commanded& end, double end_s);
  /// Four evaluations and one at the end.
  void RungeKutta(double h, const Commanded& middle, const Commanded& end, double from_s);

  /// A node to come back to.
  struct Node {
    VecX q, v, guidance;
    std::array<VecX, 6> a;
    std::array<VecX, 4> f;
    int nodes = 0;
  };
  [[nodiscard]] Node Save() const { return {q_, v_, guidance_, a_, f_, nodes_}; }
  void Restore(const Node& node);
  /// Changes the velocity of the present node, before EvaluateAgain().
  void Strike(const VecX& change) { v_ += change; }
  /// The present node once more, where forces have jumped.
  void EvaluateAgain(const Commanded& at, double t_s);

  /// False once the accelerations have diverged.
  [[nodiscard]] bool healthy() const { return IsSane(d_->qacc, m_->nv); }

 private:
  enum class Guidance { kNew, kOfTheNode };  // by the present state, or as at the last node
  void Evaluate(const VecX& q, const VecX& v, const Commanded& at, double t_s,
                Guidance guidance = Guidance::kNew);
  void SetReference(const VecX& v, const DrivenSample& at, Guidance guidance);
  void ApplyReference();
  void SetFrictionRows(const VecX& v);
  void SolveOnce();
  void HoldFriction(const VecX& gives);
  [[nodiscard]] bool FrictionExceeds() const;
  [[nodiscard]] VecX DecideFriction();
  [[nodiscard]] bool RefineFriction(VecX* gives) const;
  void SolveConstraints();
  void SolveSmooth();
  void Settle();
  void SolveAgain();
  [[nodiscard]] double ShareReturned();
  void Harden(const Commanded& first);
  void RememberNode();
  [[nodiscard]] bool PassesSingularPose();
  void Coast();
  void MeasureMiddle(double h, const VecX& v_0, const VecX& a_0, const VecX& a_1,
                     const Commanded& middle, double t_s);
  VecX Stage(const VecX& u, const VecX& v, const Commanded& at, double t_s);
  [[nodiscard]] VecX Rate(const VecX& u, const VecX& v) const;
  [[nodiscard]] Eigen::Map<const VecX> qacc() const { return {d_->qacc, m_->nv}; }

  Session& s_;
  const mjModel* const m_;
  mjData* const d_;
  double b_ = 0.0, k_ = 0.0;  // of (1)
  double softness_;           // R by MuJoCo's own at its strongest impedance, 0.9999
  VecX largest_R_;            // per row [1/kg], [1/(kg m²)]
  VecX R_unit_;               // per row: what MuJoCo's own R is multiplied by
  VecX largest_friction_R_;   // the same, per row of friction
  VecX friction_R_, friction_aref_;
  VecX q_, v_;  // corrected state at the present node
  VecX q_p_, v_p_, mean_, work_, warm_;
  VecX bias_, rate_, guidance_, aref_, expected_;
  Commanded at_;  // of the state evaluated last
  double time_s_ = 0.0;
  std::array<VecX, 6> a_;  // accelerations at the last nodes, newest first
  std::array<VecX, 4> f_;  // constraint forces there
  int nodes_ = 0;          // of these that lie at equal distances
  double largest_pivot_ = 0.0;
};

// The fastest rate at which springs, dampers and servos let a mechanism vibrate or creep, and the
// step that can follow it.
//
// With N the motions that all constraints leave (J N = 0), small motions q̇ = N x obey
//   M_N ẍ + C_N ẋ + K_N x = 0,   A_N = Nᵀ A N,
//   K = Σ k u uᵀ, C = Σ c u uᵀ   (u: gradient of a spring's length or of a servo's coordinate)  (1)
// and the rates are |λ| of [0 I; −M_N⁻¹K_N −M_N⁻¹C_N].                                        (2)
// The fourth-order scheme lets a mode drift, as measured on one spring, by about
//   1e-3 (|λ| h)⁴ |λ| min(T, 1/|Re λ|)                                                        (3)
// of its amplitude over a motion of length T.
// Geometric stiffness (loads, gravity) is left out: it is slow beside what is asked for here.

struct FastestRate {
  double per_s = 0.0;  ///< |λ| [1/s]; 0 without springs and servos, or where nothing is free
  std::string part;    ///< spring or drive that has most of it
  /// (3) over h⁴ of the mode that drifts most [1/s⁴], and its rate and part.
  double drift = 0.0, drift_per_s = 0.0;
  std::string drift_part;
};

/// At the data's configuration, whose position stage is evaluated.
[[nodiscard]] FastestRate FastestRateOf(const ConstraintSystem& system, const ServoGains& servo,
                                        double duration_s);

/// Steps per period (2π over the rate) below which the scheme is not stable, and the drift (3)
/// above which a step is reported as too coarse.
inline constexpr double kLeastStepsPerPeriod = 4.0 * std::numbers::pi, kMostDrift = 1e-5;

}  // namespace mbv::simulation
