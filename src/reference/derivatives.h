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
#pragma once

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

 private:
  using Twists = std::vector<Vec6>;

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
  void DifferentiateRates(const BodyStates& states, const MatX& T, const std::vector<Twists>& unit,
                          int first_coordinate, ForceDerivatives* out);
  void VaryCompensation(const BodyStates& states, const Twists& U, Twists* dw) const;
  void VaryElements(const BodyStates& states, const std::vector<int>& friction_signs,
                    const Twists& U, const Twists& dV, const Twists& dA, Twists* dw) const;

  const Mechanism& mechanism_;
  const double length_;
  SquareSystem system_;
  std::vector<int> selection_;
  const RowSet* rows_ = nullptr;
  std::vector<RowSet> varied_;  ///< along each column of T
  RowSet along_V_, along_dV_;
  VecX step_;
};

}  // namespace mbv::internal
