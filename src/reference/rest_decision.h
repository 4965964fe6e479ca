// Dry friction at rest: who sticks, and who starts which way. Internal to reference/.
//
// In the motions R u̇ that loops and commands leave (free_dynamics.h), with the forces λ of friction
// along the coordinates q of all elements at rest,
//   H u̇ = f + Gᵀλ,  q̈ = G u̇ + d,  |λ_e| ≤ F_e,  q̈_e ≠ 0 ⇒ λ_e = −F_e sign q̈_e                   (1)
// are the conditions for the least of the strictly convex
//   ½ (u̇ − H⁻¹f)ᵀ H (u̇ − H⁻¹f) + Σ F_e |q̈_e|                                                   (2)
// (Gauss' principle): u̇ exists and is unique, whatever shares the load [Glocker 2001]. Its dual is
//   least of ½ λᵀA λ + λᵀc with |λ_e| ≤ F_e,  A = G H⁻¹Gᵀ, c = G H⁻¹f + d                       (3)
// All stick as long as no motion y gets more power from the load r = H u̇ − f = Gᵀλ of the held
// state than friction can take:
//   max_y rᵀy / Σ F_e |G_e y| ≤ 1                                                               (4)
// (the largest |λ_e|/F_e where the rows of G are independent). The maximum lies where all G_e y
// but those of one independent row less vanish.
#pragma once

#include <vector>

#include "base/types.h"

namespace mbv::internal {

struct RestSystem {
  MatX H;     ///< inertia (DOF × DOF)
  VecX f;     ///< forces along the DOFs but for friction at rest
  MatX G;     ///< gradients of the coordinates at rest (elements × DOFs)
  VecX d;     ///< their accelerations where u̇ = 0
  VecX most;  ///< breakaway forces F_e > 0
};

/// u̇ with all elements held.
[[nodiscard]] VecX HeldMotion(const RestSystem& system);

/// (4) of all elements held; NaN where too many of them share the load. `direction`: G y
/// of the motion that is nearest to starting, per element, where forces would drive it.
[[nodiscard]] double LoadRatio(const RestSystem& system, VecX* direction = nullptr);

/// Friction λ along each coordinate while all are held; where they share the load in many ways,
/// that of which the largest |λ_e|/F_e is least, then the next: at the start of a motion it is what
/// all that start exert. NaN as LoadRatio().
[[nodiscard]] VecX LeastShares(const RestSystem& system);

/// (1): per element the sign of its acceleration, 0 where it sticks. False where none is found.
[[nodiscard]] bool DecideRest(const RestSystem& system, std::vector<int>* sign);

}  // namespace mbv::internal
