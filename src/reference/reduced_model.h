// The reduced model: a closed-loop mechanism as functions of chosen coordinates q, as many as it
// has degrees of freedom. Everything else depends on them through the loops:
//
//   V = T v                                twists of all bodies, v = dq/dt                    (1)
//   A = T a + Σ_ij H_ij v_i v_j            accelerations, a = dv/dt                           (2)
//   M a + h = f,   M = Tᵀ 𝓜 T,  h = Tᵀ w(q, v, T-part of a = 0)                               (3)
//
// with 𝓜 the inertia of all bodies and rotors, w what Newton–Euler asks of each body beyond
// gravity, springs, force elements and loads, and f the force along each coordinate. With J_d the
// rates of the drives per unit of v, drive forces τ give f = J_dᵀ τ [García de Jalón, Bayo 1994,
// ch. 5].
//
// Prescribed joints that are not among the coordinates stay at home. Stands on the reference's loop
// closure and forces: no MuJoCo, no formula of a paper.
#pragma once

#include <memory>
#include <vector>

#include "base/run_summary.h"
#include "base/types.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/reference.h"

namespace mbv {

/// Some forces, as functions of the coordinates, their rates and accelerations; a column per
/// coordinate.
struct ForceSlopes {
  VecX force;
  MatX by_position, by_velocity, by_acceleration;
};
/// Of f(q, v, a) = M a + h, the force along each coordinate: ∂f/∂q, ∂f/∂v and ∂f/∂a, which is M
/// where no friction grows with loads, each n × n [N or N m per m or rad, and per s].
struct ForceDerivatives : ForceSlopes {
  MatX drive_rates;                     ///< J_d: drives × n
  std::vector<MatX> drive_rate_slopes;  ///< ∂J_d/∂q_k
  /// What ∂f/∂q and ∂f/∂v are sums of (reference/derivatives.h), where it was asked for.
  struct Term {
    const char* name;
    MatX by_position, by_velocity;
  };
  std::vector<Term> terms;
};
/// Every force that a motion needs [N or N m].
struct EveryForce {
  /// Drives and prescribed joints exert what acts; false: the coordinates do, where drives are too
  /// few or share their forces.
  bool of_drives = false;
  ForceSlopes acting;     ///< of drives and prescribed joints, or of the coordinates
  ForceSlopes reactions;  ///< joints · 6, as ReactionChannels()
  /// Per component of reactions: statics leaves it no choice, here and at states nearby.
  std::vector<bool> unique;
  double control = kNan;  ///< smallest singular value of the equations of forces
};

/// Of a(q, v, τ) under drive forces τ: ∂a/∂q, ∂a/∂v (n × n) and ∂a/∂τ = M⁻¹ J_dᵀ (n × drives).
struct MotionDerivatives {
  MatX by_position, by_velocity, by_force;
};
/// By (3): M ∂a = ∂(J_dᵀ τ) − ∂f. False where M is singular.
[[nodiscard]] bool MakeMotionDerivatives(const ForceDerivatives& of, const VecX& drive_forces,
                                         MotionDerivatives* out);
/// ∂f/∂q less what constant drive forces change with the pose, ∂(J_dᵀ τ)/∂q.
[[nodiscard]] MatX StiffnessOf(const ForceDerivatives& of, const VecX& drive_forces);

class ReducedModel {
 public:
  /// `coordinates`: independent of each other at home (ChooseCoordinates()), n of them. The
  /// mechanism outlives the object.
  ReducedModel(const Mechanism& mechanism, const std::vector<Coordinate>& coordinates);
  /// The same with sums of coordinates (a difference of two drives); names and profiles are of no
  /// influence.
  ReducedModel(const Mechanism& mechanism, std::vector<Command> coordinates);
  ~ReducedModel();
  ReducedModel(ReducedModel&&) noexcept;

  [[nodiscard]] Eigen::Index size() const;  ///< n
  /// The coordinates at the home pose [m or rad].
  [[nodiscard]] VecX home() const;

  /// Closes the loops at q and moves with v and a [n each]: from the pose reached last, the first
  /// time from home, by a way short enough that no assembly is changed. After a failure the next
  /// call begins at home.
  [[nodiscard]] RunSummary Move(const VecX& q, const VecX& v, const VecX& a);
  /// Forgets the pose: the next call begins at home.
  void Restart();
  /// Whether Move() searches what stays open where it fails (ReferenceOptions), from the next
  /// Restart() or failure on.
  void Explain(bool on);

  // Of the state that Move() reached last.

  [[nodiscard]] const BodyStates& states() const;
  /// Drives and prescribed joints, outputs: what ReferenceSample names so.
  [[nodiscard]] const ReferenceSample& sample() const;
  /// Of AllForces(), as sample() has them.
  [[nodiscard]] const VecX& drive_force() const;
  /// T of (1): 6·(bodies − 1) × n, [ω; v of Bo] of each moving body in world axes.
  [[nodiscard]] RunSummary Motions(MatX* T);
  /// H of (2): 6·(bodies − 1) × n·n, column i n + j; H_ij = H_ji.
  [[nodiscard]] RunSummary Curvatures(MatX* H);
  /// M of (3), n × n, symmetric.
  [[nodiscard]] MatX MassMatrix(const MatX& T) const;
  /// An element whose friction grows with the load on its joint, or nullptr. Such friction depends
  /// on where forces act: (3) is without it.
  [[nodiscard]] const ForceElement* friction_by_load() const;
  /// M a + h: the force along each coordinate [N or N m] that the state needs beyond the loads.
  /// Friction at rest counts as 0.
  [[nodiscard]] VecX Forces(const MatX& T, const std::vector<LoadSample>& loads);
  /// The same with friction by load, f = J_dᵀ τ under forces of drives and prescribed joints, which
  /// have to be unique.
  [[nodiscard]] RunSummary ForcesOf(const MatX& T, const std::vector<LoadSample>& loads, VecX* f);
  /// (3) solved for a, with drive forces τ, where Move() was called with a = 0. kSingular where a
  /// coordinate moves no mass; kUnsupported with dry friction at rest or by load, which leave a
  /// choice (free_motion.h integrates those).
  [[nodiscard]] RunSummary Accelerations(const MatX& T, const std::vector<LoadSample>& loads,
                                         const VecX& drive_forces, VecX* a);
  /// Derivatives of M a + h, of ForcesOf() with friction by load, at the state that Move() reached.
  /// kUnsupported with dry friction at rest, where there are none.
  [[nodiscard]] RunSummary Derivatives(const MatX& T, const std::vector<LoadSample>& loads,
                                       ForceDerivatives* out, bool terms = false);
  /// Of every force, in the same way; friction by load counts where drives exert the forces.
  /// kUnsupported also where a joint whose load makes friction bears none.
  [[nodiscard]] RunSummary AllDerivatives(const MatX& T, const std::vector<LoadSample>& loads,
                                          EveryForce* out);
  /// Values alone, of the forces of `out->of_drives`.
  [[nodiscard]] RunSummary EachForce(const MatX& T, const std::vector<LoadSample>& loads,
                                     EveryForce* out);
  /// J_d: drives × n.
  [[nodiscard]] MatX DriveRates(const MatX& T) const;
  /// Forces of drives and prescribed joints and all reactions, in sample(); as the reference, the
  /// least ones where the equations leave a choice.
  [[nodiscard]] RunSummary AllForces(const std::vector<LoadSample>& loads);

 private:
  /// kUnsupported where friction makes forces no function of the state that has derivatives.
  [[nodiscard]] RunSummary CheckFriction(const std::vector<int>& signs, bool by_load = true) const;
  /// Rates of drives, then of prescribed joints, per unit of v.
  [[nodiscard]] MatX ActingRates(const MatX& T) const;
  [[nodiscard]] RunSummary EveryForceOf(const MatX& T, const std::vector<LoadSample>& loads,
                                        bool slopes, EveryForce* out);

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mbv
