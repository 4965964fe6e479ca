// Screws of a limb and of the equivalent 3-RPS mechanism [Li 2018, Eqs. 1, 2, 15, 16].
//
// The pipeline uses the short forms (d), (e) of limb_kinematics.h; these are the paper's own
// forms, which must give the same rates.
//
// Used terms: a screw is [s; r × s] (rotation) or [0; s] (translation); {A_i} as in
// limb_kinematics.h, with the tip on Z; φ_i angle of the virtual revolute joint, always at rest.
//
// (1)  $1 X at U1, $2 Y at A, $3 X at R12, $4 X at B, $5 Y at B, $6 Z at B, $7 X at R12',
//      $8 X at U1', $9 Y at A;  R12' = (0, −b2, +c2)      (printed −c2; labels 6 and 8 doubled)
//      The print writes $6 = (0 0 1; 0 0 0), which is Z at B for B on Z.
// (2)  equivalent RPS limb: Y at A, translation along Z (scaled by c3), X, Y, Z at B
// (15) $1 e_r at A_i (virtual), $2 e_t at A_i, $3 = [0; A_iB_i/l], $4…$6 = [e_k; B_i × e_k]
// (16) q' = G °V_op,  q''_m = G_m °A_op − q'ᵀ H^(m) q',  q = (l1, l2, l3, φ1, φ2, φ3)
//      row of l_i (φ_i) in G: row 3 (1) of J_i⁻¹, J_i = [$1 … $6]
//      H^(m) = Σ_{j<k} (that row · [$j, $k]) T_jᵀ T_k,  T = J_i⁻¹ G⁻¹
#pragma once

#include <array>

#include "analytic/stabilizing_platform/limb_kinematics.h"

namespace mbv::stabilizing_platform {

/// (1) in {A_i}, for foot (0, ∓b1, 0), elbows (0, ±b2, c2) and tip (0, 0, c3).
[[nodiscard]] std::array<Vec6, 9> LimbScrews(double b1, double b2, double c2, double c3);
/// (2) in {A_i}.
[[nodiscard]] std::array<Vec6, 5> EquivalentScrews(double c3);

/// (15) in {o}: columns $1 … $6 of limb i.
[[nodiscard]] Mat6 VirtualLimbScrews(const LimbPlace& place, const LimbMotion& limb);

/// (16): first- and second-order influence matrices of q = (l1, l2, l3, φ1, φ2, φ3).
struct InfluenceMatrices {
  Mat6 G;
  std::array<Mat6, 6> H;
};
[[nodiscard]] InfluenceMatrices ComputeInfluence(const std::array<LimbPlace, 3>& places,
                                                 const std::array<LimbMotion, 3>& limbs);

/// Rates q' and accelerations q'' by (16).
struct EquivalentRates {
  Vec6 rate, acceleration;
};
[[nodiscard]] EquivalentRates RatesOf(const InfluenceMatrices& influence, const Vec6& V_op,
                                      const Vec6& A_op);

}  // namespace mbv::stabilizing_platform
