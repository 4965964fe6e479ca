// Friction that grows with the joint's own reaction. Internal to reference/.
//
//   F_e = −μ_e r_e N_e sign q̇_e,  N_e = |R_e − a (a·R_e)|                                      (1)
// R_e: force of the parent on the child through the joint, a: its axis; r = 1 in a guide. A journal
// bears its radial load, a guide the force across it (its moments are not counted)
// [Shigley, Mechanical Engineering Design, "Boundary-lubricated bearings"].
//
// The reactions depend on the friction, linearly: with p_e = R_e − a (a·R_e) without friction by
// load, and P_ed the part of it per unit of force F_d,
//   n_e = |p_e − Σ_d P_ed sign q̇_d μ_d r_d n_d|                                                (2)
// which has one solution, and a fixed-point iteration that finds it, if
//   q = max_e Σ_d |P_ed| μ_d r_d < 1                                                           (3)
#pragma once

#include <vector>

#include "core/run_summary.h"
#include "core/types.h"
#include "mechanism/mechanism.h"

namespace mbv::internal {

/// Indices of the elements with friction by load.
[[nodiscard]] std::vector<size_t> LoadedElements(const Mechanism& mechanism);

/// Component across its joint's axis of the reaction force of an element's joint, F's axes, from
/// `reactions` (joints × 6).
[[nodiscard]] Vec3 AcrossAxis(const Mechanism& mechanism, size_t element, const MatX& reactions);

/// kUnsupported: redundant constraints share the load of an element's joint.
[[nodiscard]] RunSummary LoadShared(const Mechanism& mechanism, size_t element);

/// (2): all p and P of the loaded elements; `sign`: of their rates, 0 at rest.
struct LoadSystem {
  std::vector<Vec3> p;               ///< per loaded element [N]
  std::vector<std::vector<Vec3>> P;  ///< [e][d]
  std::vector<double> sign, per_load;

  [[nodiscard]] double contraction() const;  ///< (3)
  /// The loaded element whose load the others raise most.
  [[nodiscard]] size_t MostRaised() const;
  /// n_e [N]; kSingular where (3) does not hold, with q.
  [[nodiscard]] RunSummary Solve(VecX* n) const;

 private:
  [[nodiscard]] double Raised(size_t e) const;
};

}  // namespace mbv::internal
