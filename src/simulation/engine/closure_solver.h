// Solutions of the constraint system: positions by Newton, then velocities, accelerations and
// forces from the same Jacobian, factored in units that suit the mechanism's size.
#pragma once

#include <string>
#include <vector>

#include "base/run_summary.h"
#include "math/rate_extrapolation.h"
#include "math/sparse.h"
#include "mechanism/motion.h"
#include "simulation/engine/constraint_system.h"
#include "simulation/engine/engine_model.h"

namespace mbv::simulation {

// Predicts the configuration at the next of equally spaced samples (math/rate_extrapolation.h).

class SamplePredictor {
 public:
  /// The model outlives it.
  explicit SamplePredictor(const EngineModel& engine) : engine_(engine) {}

  /// Moves d.qpos to the next sample, h later, by the present d.qvel and d.qacc and those of the
  /// calls before.
  void Predict(double h, mjData* d);

 private:
  const EngineModel& engine_;
  int known_ = 0;
  RateHistory history_;
  VecX u_;
};

class ClosureSolver {
 public:
  explicit ClosureSolver(ConstraintSystem* system);

  /// Moves d.qpos from the present (closed) configuration with targets `from` to the targets `to`,
  /// in as many intermediate steps as it takes to stay in the same assembly; at once where no way
  /// leads there by steps, as between positions of drives that depend on each other.
  [[nodiscard]] RunSummary Follow(const VecX& from, const VecX& to);
  /// The same, where d.qpos is a prediction for the targets `to` and `closed` the configuration
  /// with the targets `from`.
  [[nodiscard]] RunSummary FollowPredicted(const VecX& closed, const VecX& from, const VecX& to);

  /// Newton from d.qpos to the targets `to`. On success MuJoCo's position stage, J and its
  /// factors belong to the final qpos up to round-off.
  [[nodiscard]] RunSummary Close(const VecX& to);

  /// d.qvel with J q̇ = [0; ẋ], minimum norm where DOFs are not driven. Evaluates mj_comVel.
  void SolveVelocity(const VecX& driven_velocity);
  /// The least change of d.qvel that meets J q̇ = [0; ẋ]. Evaluates mj_comVel.
  void CorrectVelocity(const VecX& driven_velocity);
  /// d.qacc with J q̈ = [0; ẍ] − J̇q̇.
  void SolveAcceleration(const VecX& driven_acceleration);
  /// λ with Jᵀλ = τ, minimum norm where it is not unique; written to d.efc_force.
  void SolveForces(const VecX& tau);

  /// Of all λ with Jᵀλ = τ, the one whose driven forces (moments divided by the characteristic
  /// length) have least norm, written to d.efc_force. With N the motions that the closures leave
  /// (J_c N = 0) the driven forces are the least-norm u of
  ///   (J_u N)ᵀ u = Nᵀ τ,  then J_cᵀ λ_c = τ − J_uᵀ u
  void SolveLeastDriven(const VecX& tau);

  /// As SolveForces, for the present J; keeps rank and factors of the last configuration solved.
  void SolveForcesHere(const VecX& tau);
  /// Smallest over largest pivot of the present J among as many as the last configuration solved
  /// had independent rows, of many velocities the least singular value that is not zero over the
  /// longest row: 0 where a constraint is lost.
  [[nodiscard]] double WeakestPivot();

  /// Takes the part out of row forces that does not act on the present configuration: what remains
  /// is J x for some x. As many dimensions as rows were redundant when last solved.
  void RemoveSelfStress(VecX* force);

  /// Row forces that balance each other at the last configuration solved: rows × redundant().
  [[nodiscard]] MatX SelfStress() const;

  [[nodiscard]] int undriven() const { return system_->nv() - rank_; }
  [[nodiscard]] int redundant() const { return system_->rows() - rank_; }
  /// Rows of prescribed coordinates whose force is not unique at the present configuration.
  [[nodiscard]] std::vector<int> DrivenRowsNotUnique() const;

 private:
  // Close(to) from here; where that does not arrive, or only farther away than `farthest`, `way`;
  // and the former after all where `way` does not arrive.
  template <typename Way>
  [[nodiscard]] RunSummary CloseOr(const VecX& to, double farthest, VecX* here, Way&& way);
  [[nodiscard]] RunSummary Walk(const VecX& from, const VecX& to);
  [[nodiscard]] MatX ScaledSelfStress() const;
  [[nodiscard]] double SelfStressIn(const VecX& force) const;
  [[nodiscard]] bool DrivenRowsAreUnique() const;
  void Factor();
  [[nodiscard]] bool FactorBeside();
  [[nodiscard]] bool FactorHere();
  void Hold(const SparseRank& rank);
  [[nodiscard]] VecX WithoutMotions(const VecX& x) const;
  [[nodiscard]] VecX LeastForces(const VecX& tau) const;
  [[nodiscard]] double WeakestByIteration();
  void SolveInto(const VecX& b, VecX* x, int refinements = 1);  // x = J⁺ b
  void SolveTransposedInto(const VecX& b, VecX* x);             // x = (Jᵀ)⁺ b

  ConstraintSystem* const system_;
  enum class Factors {
    kNone,         // no rows
    kSquare,       // lu_: as many rows as velocities, of full rank
    kOverdefined,  // least_: many velocities, of full rank, and more rows
    kBeside,       // least_, beside rows that hold some of many velocities: J leaves motions
    kOrthogonal,   // cod_
  };
  Factors factors_ = Factors::kNone;
  int rank_ = 0;
  SparseLu::Matrix columns_;  // J'ᵀ
  SparseLu lu_;               // of it
  SparseLeastNorm least_;     // with it
  SparseLu::Matrix
      columns_here_;  // the same of the present J, where that moves on without Factor()
  SparseLeastNorm least_here_;
  std::vector<int> held_;       // velocities held where J leaves motions
  SparseLu::Matrix held_rows_;  // as columns
  MatX motions_;                // orthonormal, of J'
  VecX soft_;                   // what WeakestPivot() last found to hardly move a row
  Eigen::CompleteOrthogonalDecomposition<MatX> cod_;
  VecX rhs_, step_, bias_, refinement_, scaled_;
  double moved_ = 0.0;  // by the last Close, in the units of ScaledJ(): sum of its largest entries
  std::vector<double> reached_;  // last closed configuration on the way of Walk
  VecX began_, predicted_;       // configurations before Follow and FollowPredicted
};

}  // namespace mbv::simulation
