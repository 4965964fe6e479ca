// Stiffness by simulation: MuJoCo on a compliant model in which every beam is cut at mid-span and
// its halves are held together by six springs (the compliance of an Euler–Bernoulli beam is
// diagonal there), loaded and brought to static equilibrium.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "math/stiffness.h"
#include "mechanism/mechanism.h"
#include "simulation/engine/constraint_system.h"
#include "simulation/mjcf/compliant.h"

// Static equilibrium of a compliant model on MuJoCo's kinematics, springs and constraint rows.
//
// Unknowns: configuration q, loop forces λ and, where the output is held, the wrench F that holds
// it. With spring forces s(q), rows r(q) = 0 with Jacobian J, output Jacobian J_o (6 × nv, rotation
// first, about the output's origin):
//
//   f = s + Jᵀλ + J_oᵀF = 0,  r = 0,  and held: [log(R R_tᵀ); p − p_t] = 0                     (1)
//
// Step at the stress-free pose, K the springs' diagonal (dofs with springs s, without i):
//
//   K_s dq_s = f_s + J_sᵀdλ                                                                   (2)
//   [J_s K_s⁻¹ J_sᵀ   J_i] [dλ  ]   [−r − J_s K_s⁻¹ f_s]
//   [J_iᵀ              0 ] [dq_i] = [−f_i              ]                                      (3)
//
// (held: J_o is appended to J; a spring tendon is a row of compliance 1/k). The matrix of (3) is
// small and symmetric; its pseudo-inverse leaves idle DOFs alone and gives redundant rows
// their least forces. It serves all small loads unchanged, which converges by a factor of the
// relative change of geometry per iteration. Large loads take Newton steps with the tangent of f
// by central differences, geometric stiffness included, and load steps if need be.

namespace mbv::simulation {

class Statics {
 public:
  /// Compiles the model. Throws EngineError; unsupported drives are in `summary`.
  Statics(const mjcf::CompliantModel& model, RunSummary* summary);
  Statics(const Statics&) = delete;
  Statics& operator=(const Statics&) = delete;

  /// A state with what balances it.
  struct State {
    VecX q;                  ///< MuJoCo's qpos
    VecX lambda;             ///< per row
    Vec6 F = Vec6::Zero();   ///< wrench on the output [m; f], applied or holding it
    double residual = kNan;  ///< largest unbalanced force, relative to the load
    double gap = kNan;       ///< largest open row [m, rad], relative to the size for lengths
    int iterations = 0;
    [[nodiscard]] bool converged() const { return residual <= kBalanced && gap <= kClosed; }
  };
  static constexpr double kBalanced = 1e-9, kClosed = 1e-12;

  /// The stress-free pose, up to the loops' round-off.
  [[nodiscard]] State Home() const;

  /// Equilibrium under the wrench F, from a state nearby; `load_N` is the force to which the
  /// residual refers, for a load that may be zero.
  [[nodiscard]] State UnderLoad(const State& from, const Vec6& F, double load_N);
  /// Equilibrium with the output displaced by D = [Δγ; Δε] from its pose at `base`.
  [[nodiscard]] State Displaced(const State& base, const Vec6& D, double load_N);

  /// First-order answers at Home: the wrench that displaces the output by D, and the displacement
  /// under F. False where no finite answer exists: the output is rigidly held in D's direction, or
  /// free to move in F's.
  [[nodiscard]] bool LinearWrench(const Vec6& D, Vec6* F);
  [[nodiscard]] bool LinearDisplacement(const Vec6& F, Vec6* D);

  /// Displacement of the output from `base` to `state`.
  [[nodiscard]] Vec6 Displacement(const State& base, const State& state);
  /// Deformation of every spring of the model.
  [[nodiscard]] VecX Deformations(const State& state);

  /// A length that makes moments comparable with forces and rotations with displacements [m].
  [[nodiscard]] double size() const { return size_; }
  /// False if the output is on the ground.

 private:
  // (2) and (3) at the stress-free pose. Rows: J_, then spring tendons.
  struct Condensed {
    bool held = false;
    MatX J;        // all columns
    MatX inverse;  // pseudo-inverse of (3)
  };
  struct Target {
    bool held = false;
    Vec6 F = Vec6::Zero();         // applied; not held
    Pose X_WO = Pose::Identity();  // held
    double load = 1.0;             // [N]
  };

  void Evaluate(const State& state, const Target& target);  // fills f_, r_ and Jacobians
  void Measure(State* state, const Target& target) const;
  void Apply(const VecX& dq, const VecX& dlambda, State* state, const Target& target) const;
  [[nodiscard]] Condensed Condense(bool held);
  void CondensedStep(const Condensed& condensed, const VecX& f, const VecX& r, VecX* dq,
                     VecX* dlambda) const;
  void NewtonStep(const State& state, const Target& target, VecX* dq, VecX* dlambda);
  [[nodiscard]] State Iterate(const State& from, const Target& target, bool newton);
  [[nodiscard]] State Solve(const State& from, const Target& target);
  [[nodiscard]] MatX ForceTangent(const State& state, const Target& target);
  [[nodiscard]] Pose OutputPose() const;

  const mjcf::CompliantModel& model_;
  EngineModel engine_;
  DataHandle data_;
  std::unique_ptr<ConstraintSystem> system_;
  int output_body_ = 0;  // MuJoCo's
  double size_ = 1.0;
  VecX flexibility_;            // per dof: 1/k, 0 where there is no spring
  std::vector<int> free_dofs_;  // without spring
  VecX unit_;                   // per dof: 1 for lengths, size_ for angles
  struct SpringPlace {
    int qpos = -1, tendon = -1;  // one of them
  };
  std::vector<SpringPlace> springs_;  // per spring of the model
  Condensed applied_, held_;

  // At the last evaluated state.
  VecX f_, r_;
  MatX J_;  // rows of loops and drives, then the output's if held
  MatX J_o_;
};

}  // namespace mbv::simulation

namespace mbv {

/// Largest loads of the small-load extrapolation. They are reduced where the output would move by
/// more than 1e-4 of the mechanism's size or rad: larger motions bring geometry in, smaller ones
/// drown in the round-off of positions.
struct CompliantOptions {
  double force_N = 1000.0;   ///< > 0
  double moment_Nm = 100.0;  ///< > 0
};

/// One finite load: the platform's displacement in equilibrium, geometry included.
struct LoadedDisplacement {
  Vec6 displacement = Vec6::Constant(kNan);  ///< [Δγ; Δε], rotation vector, world axes
  double residual = kNan;  ///< unbalanced force after the last Newton step, relative to the load
  int iterations = 0;
};

struct CompliantRun {
  StiffnessResult result;             ///< at zero load, extrapolated
  double extrapolation_error = kNan;  ///< relative, of C: difference of the last two extrapolates
  double residual = kNan;             ///< worst of all load cases
  std::vector<LoadedDisplacement> loaded;  ///< per given wrench
  std::string mjcf;                        ///< the model as simulated
};

/// Stiffness of output `output` with all drives held by their servos in the pose X_WB (one pose
/// per body, loops closed), and the displacements under finite `wrenches` [m; f] (world axes, about
/// the output's origin). kEngineFailure and kNoConvergence in the result's summary.
[[nodiscard]] CompliantRun SimulateStiffness(const Mechanism& mechanism,
                                             const std::vector<Pose>& X_WB, int output,
                                             const std::vector<Vec6>& wrenches,
                                             const CompliantOptions& options = {});

}  // namespace mbv
