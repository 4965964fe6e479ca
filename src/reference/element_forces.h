// Forces, energies and powers of force elements along their coordinates q. Internal to reference/.
//
//   damping  F = −c q̇                                        P = −c q̇² to the dampers         (1)
//   spring   F = −(F0 + Σ_i k_i x^i),  x = q − free           E = F0 x + Σ_i k_i x^(i+1)/(i+1)  (2)
//   rotor    F = −J n² q̈                                      E = ½ J n² q̇²                     (3)
//   friction F = −(Fc + (Fs − Fc) exp(−(q̇/vs)²)) sign q̇       P = F q̇ to the dampers           (4)
#pragma once

#include <vector>

#include "core/run_summary.h"
#include "kinematics/element_rows.h"
#include "reference/reference.h"

namespace mbv::internal {

/// Takes the elements' forces away from the wrenches that bodies need (RequiredWrenches()); that
/// of rotors at states.A_WB.
void TakeElementForces(const Mechanism& mechanism, const BodyStates& states,
                       std::vector<Vec6>* wrench_W);

void AddElementEnergies(const Mechanism& mechanism, const BodyStates& states, Energies* energy);
/// Of the rotors: the rate of their kinetic energy.
void AddElementPowers(const Mechanism& mechanism, const BodyStates& states, Powers* power);

/// kUnsupported where an element with friction is at rest (RestRate()): statics leaves its force
/// open within a band, and with it those of the drives.
[[nodiscard]] RunSummary CheckRubbing(const Mechanism& mechanism, const BodyStates& states,
                                      double duration_s);

/// Adds what motions R (6·bodies × n) call for of rotors: Σ J n² u (uᵀR), u: gradient of the
/// coordinate.
void AddRotorMomenta(const Mechanism& mechanism, const BodyStates& states, const MatX& R, MatX* MR);

/// An element's slope of force over position and over rate, along `u` the gradient of its
/// coordinate: what vibrates or creeps.
struct ElementSlope {
  double stiffness = 0.0, damping = 0.0;
};
[[nodiscard]] ElementSlope SlopeOf(const ForceElement& element, double q);

}  // namespace mbv::internal
