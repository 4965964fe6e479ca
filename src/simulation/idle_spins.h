// Idle spins (mechanism/idle_spins.h) in MuJoCo's coordinates. The constraints leave them open, and
// least-norm solutions would turn them as the units of the coordinates happen to share: here each
// is put where the motion has it.
//
//   the part hangs on the ball that comes first in the tree; w_i: world axes of that ball's
//   velocities, v_i: of the other ball's, if it is in the tree, too. The motion that spins the
//   part and nothing else is
//     q̇ = s ν,  ν_i = n·w_i,  ν_i = −n·v_i                                                      (1)
//   with J ν = 0. Over the velocities that turn the part, from the root to the first ball:
//     n·ω = Σ n·w_j q̇_j,  n·ε = Σ n·(w_j q̈_j + ẇ_j q̇_j)                                         (2)
//   and as n·ω of ν is 1, these become zero by q̇ −= (n·ω) ν, q̈ −= (n·ε) ν. In inverse mode, where
// nothing integrates, the lines are transported parallel from sample to sample
// (core/parallel_transport.h); the first one takes the least turns from home.
#pragma once

#include <vector>

#include "core/parallel_transport.h"
#include "core/run_summary.h"
#include "mechanism/idle_spins.h"
#include "simulation/closure_solver.h"
#include "simulation/constraint_system.h"

namespace mbv::simulation {

class SpinStopper {
 public:
  /// The system outlives it.
  explicit SpinStopper(ConstraintSystem* system);

  [[nodiscard]] int count() const { return static_cast<int>(spins_.size()); }

  /// Puts d.qpos, where the solver has closed the loops for `first`, to the least turns from home.
  [[nodiscard]] RunSummary TakeLeastTurns(ClosureSolver* solver, const DrivenSample& first);
  /// Takes n·ω out of d.qvel. Evaluates mj_comVel.
  void StopVelocity();
  /// Takes n·ε out of d.qacc, at the velocity that mj_comVel was evaluated for.
  void StopAcceleration();
  /// Transports the lines to the state of time t_s, with velocity and acceleration, from that of
  /// the last call: where there was one, d.qpos is turned and closed again, and velocity and
  /// acceleration must be solved for anew (*turned).
  [[nodiscard]] RunSummary Transport(double t_s, const DrivenSample& at, ClosureSolver* solver,
                                     bool* turned);
  /// kUnsupported if τ, which closures and drives must balance, has a part along a spin.
  [[nodiscard]] RunSummary CheckIdle(const VecX& tau) const;

 private:
  struct Place {
    int first_dof = -1;      ///< of the ball on which the part hangs
    int second_dof = -1;     ///< of the other ball, if it is in the tree
    std::vector<int> chain;  ///< velocities that turn the part
  };
  // n; ω and ε of the part at the data's velocity and acceleration.
  [[nodiscard]] Vec3 Direction(size_t k) const;
  [[nodiscard]] Vec3 AngularVelocity(size_t k) const;
  [[nodiscard]] Vec3 AngularAcceleration(size_t k) const;
  [[nodiscard]] Mat3 RotationOf(size_t k) const;
  [[nodiscard]] VecX Motion(size_t k) const;
  void Turn(size_t k, double angle);

  ConstraintSystem* const system_;
  const std::vector<Spin> spins_;
  std::vector<Place> places_;
  mutable std::vector<Pose> X_WB_;
  struct LastLine {
    MovingDirection line;
    Mat3 R_WB;
  };
  std::vector<LastLine> last_lines_;  // of the last Transport(), per spin; empty: none
  double last_s_ = kNan;
};

}  // namespace mbv::simulation
