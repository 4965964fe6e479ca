// Forces, energies and powers of force elements along their coordinates q. Internal to reference/.
//
//   damping  F = −c q̇                                        P = −c q̇² to the dampers         (1)
//   spring   F = −(F0 + Σ_i k_i x^i),  x = q − free           E = F0 x + Σ_i k_i x^(i+1)/(i+1)  (2)
//   rotor    F = −J n² q̈                                      E = ½ J n² q̇²                     (3)
//   friction F = −(Fc + (Fs − Fc) exp(−(q̇/vs)²)) sign q̇       P = F q̇ to the dampers           (4)
// A rotor about the axis a of a body that turns with ω and ε has the momentum h = J n q̇ a besides:
//   M = −dh/dt = −J n (q̈ a + q̇ ω × a) on that body            E += J n q̇ a·ω                    (5)
//   F = −J n² q̈ − J n a·ε                                                                       (6)
//
// At rest friction is taken as 0, the middle of what statics allows: |F| ≤ Fs. What friction by the
// joint's load adds to (4), load_friction.h finds.
#pragma once

#include <vector>

#include "core/types.h"
#include "kinematics/element_rows.h"
#include "reference/reference.h"

namespace mbv::internal {

/// Per force element: the sign of its rate where it rubs; 0 at rest (RestRate()) and for all that
/// does not rub. Empty of a mechanism in which nothing does.
[[nodiscard]] std::vector<int> RubbingOf(const Mechanism& mechanism, const BodyStates& states,
                                         double duration_s);

/// Takes the elements' forces away from the wrenches that bodies need (RequiredWrenches()); that
/// of rotors at states.A_WB, that of friction in the directions of RubbingOf().
void TakeElementForces(const Mechanism& mechanism, const BodyStates& states,
                       const std::vector<int>& rubbing, std::vector<Vec6>* wrench_W);

/// Per element that rests: breakaway force (with `load_friction`) times its coordinate's gradient:
/// the wrenches that statics may add or take.
[[nodiscard]] std::vector<VecX> RestingWrenches(const Mechanism& mechanism,
                                                const BodyStates& states,
                                                const std::vector<int>& rubbing,
                                                const VecX& load_friction);
/// Power that friction by the joints' loads takes [W].
[[nodiscard]] double LoadFrictionLoss(const Mechanism& mechanism, const ReferenceSample& sample);
/// Gradient of a coordinate over the motions of all bodies but the world (6·bodies).
[[nodiscard]] VecX GradientOf(const ScalarRow& row, size_t bodies);

void AddElementEnergies(const Mechanism& mechanism, const BodyStates& states, Energies* energy);
/// Of the rotors: the rate of their kinetic energy.
void AddElementPowers(const Mechanism& mechanism, const BodyStates& states,
                      const std::vector<int>& rubbing, Powers* power);

/// Adds what motions R (6·bodies × n) call for of rotors: Σ J n² u (uᵀR), u: gradient of the
/// coordinate; with a carrier also J n (u aᵀ + a uᵀ) R.
void AddRotorMomenta(const Mechanism& mechanism, const BodyStates& states, const MatX& R, MatX* MR);

/// An element's slope of force over position and over rate, along `u` the gradient of its
/// coordinate: what vibrates or creeps.
struct ElementSlope {
  double stiffness = 0.0, damping = 0.0;
};
[[nodiscard]] ElementSlope SlopeOf(const ForceElement& element, double q);

}  // namespace mbv::internal
