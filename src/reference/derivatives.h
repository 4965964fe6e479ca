// Derivatives of a closed-loop mechanism's inverse dynamics by its chosen coordinates q, of f(q, v,
// a) = M a + h in (3) of reduced_model.h. Internal to reference/.
//
// By implicit differentiation. A variation moves poses by twists U, velocities by δV and
// accelerations by δA; with δJ|_U and δb|_U of kinematics/frame_pair.h the rows of loops and
// coordinates, J V = v and J A + b = a, give
//   J U   = δq                                                                                  (1)
//   J δV  = δv − δJ|_U V                                                                        (2)
//   J δA  = δa − δJ|_U A − δb|_U − δJ|_V δV − δJ|_δV V                                          (3)
// and of f = Tᵀ w with J T = 1 and Jᵀ μ = w
//   δf    = Tᵀ (δw(U, δV, δA) − (δJ|_U)ᵀ μ) (4)
// (δJ|_U)ᵀ μ is the second-order term of the constraints, which gives loaded loops a stiffness.
//
// Of every force x, reactions and what acts, with the rows G of force_solver.h,
//   Gᵀ x  = w + Σ_d s_d μ_d n_d g_d,  n_d = |p_d(x)|                                            (5)
//   Gᵀ δx = δw − (δG|_U)ᵀ x + Σ_d s_d μ_d (δn_d g_d + n_d δg_d),  δn_d = p_d · δp_d / n_d      (6)
// the sums over friction by the load p_d across a joint's axis (element_forces.h), g_d: gradient of
// its coordinate.
#pragma once

#include <optional>
#include <vector>

#include "base/run_summary.h"
#include "base/types.h"
#include "reference/element_forces.h"
#include "reference/reduced_model.h"
#include "reference/row_set.h"
#include "reference/square_system.h"

namespace mbv::internal {

class ClosureSolver;

class ForceVariations {
 public:
  explicit ForceVariations(const Mechanism& mechanism);

  /// At the state of `closure`, with its T, of which coordinates are the first commands. `terms`:
  /// with what the sums consist of. kSingular where the loops do not determine the motion.
  [[nodiscard]] RunSummary Differentiate(ClosureSolver* closure, const MatX& T,
                                         const std::vector<LoadSample>& loads,
                                         const std::vector<int>& friction_signs, bool terms,
                                         ForceDerivatives* out);
  /// The same of every force, by (5) and (6), that drives and prescribed joints exert where
  /// `out->of_drives`, else the coordinates; `slopes`: false for values alone. `load_friction`:
  /// what the loads of joints make of friction, per element [N or N m]; empty: none. kSingular
  /// where these do not control the mechanism, kUnsupported where they share their forces.
  [[nodiscard]] RunSummary DifferentiateAll(ClosureSolver* closure, const MatX& T,
                                            const std::vector<LoadSample>& loads,
                                            const std::vector<int>& friction_signs,
                                            const VecX& load_friction, bool slopes,
                                            EveryForce* out);

 private:
  using Twists = std::vector<Vec6>;

  /// Rows, factors and unit motions of a state; false where the loops do not determine the motion.
  [[nodiscard]] bool Begin(ClosureSolver* closure, const MatX& T);
  /// (2) and (3) of the k-th coordinate, and (3) of its rate.
  void MoveCoordinate(ClosureSolver* closure, size_t k, Twists* dV, Twists* dA);
  void MoveRate(const BodyStates& states, size_t k, Twists* dA);

  /// The motion with J · motion = rates, per selected row.
  void Solve(const VecX& rates, Twists* motion);
  /// Adds δJ · motion (+ δb) of the selected rows.
  void AddRates(const RowSet& varied, const Twists& motion, bool bias, double factor,
                VecX* rates) const;
  /// δw, stacked.
  void VaryWrenches(const BodyStates& states, const std::vector<LoadSample>& loads,
                    const std::vector<int>& friction_signs, const Twists& U, const Twists& dV,
                    const Twists& dA, VecX* dw) const;
  /// Of what follows coordinates: its components vary by this.
  [[nodiscard]] Vec6 VaryFollowing(const BodyStates& states, const LoadSample& sample,
                                   const Twists& U, const Twists& dV) const;
  void DifferentiateRates(const BodyStates& states, const MatX& T, int first_coordinate,
                          ForceDerivatives* out);
  void VaryCompensation(const BodyStates& states, const Twists& U, Twists* dw) const;
  void VaryElements(const BodyStates& states, const std::vector<int>& friction_signs,
                    const Twists& U, const Twists& dV, const Twists& dA, Twists* dw) const;

  const Mechanism& mechanism_;
  const double length_;
  SquareSystem system_;
  std::vector<int> selection_;
  const RowSet* rows_ = nullptr;
  std::vector<Twists> unit_;    ///< columns of T
  std::vector<RowSet> varied_;  ///< along each of them
  RowSet along_V_, along_dV_;
  bool moves_ = false;
  VecX step_, rates_;

  // Of every force.
  [[nodiscard]] RunSummary FactorForces(const ClosureSolver& closure, EveryForce* out);
  /// Of the closure's rows (those varied along `U`, where there is one), with those of drives.
  [[nodiscard]] RowSet ForceRows(const ClosureSolver& closure, const RowSet& rows, const Twists* U,
                                 bool of_drives) const;
  /// Forces of a basis with Gᵀ x = wrenches, others are 0; refined once.
  [[nodiscard]] VecX SolveForces(const VecX& wrenches);
  struct Loaded {
    size_t element = 0;
    double slope = 0.0;     ///< s c
    double load = 0.0;      ///< n
    BearingLoad direction;  ///< dn/dp
    VecX unit;              ///< forces with Gᵀ x = g
    bool shared = false;    ///< redundant constraints share the load
  };
  /// Reactions in which self-stresses have no share, and get none along a coordinate.
  void FindUnique(const BodyStates& states, const std::vector<RowSet>& varied,
                  std::vector<Loaded>* loaded, EveryForce* out);
  [[nodiscard]] std::vector<Loaded> LoadsOf(const BodyStates& states, const std::vector<int>& signs,
                                            const VecX& load_friction);
  /// The smallest singular value.
  [[nodiscard]] double Control();
  /// Moments divided by the characteristic length.
  [[nodiscard]] VecX InLengths(const VecX& force) const;
  [[nodiscard]] MatX ReactionsOf(const BodyStates& states, const VecX& force) const;
  /// What poses change of reactions under the same forces.
  [[nodiscard]] MatX VaryReactions(const BodyStates& states, const RowSet& varied,
                                   const VecX& force, const Twists& U) const;

  const std::vector<Spin> spins_;  ///< idle
  SquareSystem forces_;
  RowSet force_rows_;  ///< AddReactionRows(), then what acts, then idle spins
  int first_acting_ = 0;
  std::vector<int> basis_;
  std::optional<bool> basis_of_drives_;  ///< for which forces it was chosen
  double basis_control_ = 0.0;
  MatX self_stress_;
};

}  // namespace mbv::internal
