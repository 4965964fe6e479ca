// Kinematics of a modified-scissors limb [Li 2018, Eqs. 14, 17–20].
//
//        Z ↑      B (tip, ball at the upper platform)           limb plane {A_i}: origin A_i,
//          │    ╱╲                                              [X Y Z] = [e_r e_t e_z] Ry(λ) in
//          {o},
//       2' │  ╱    ╲ 2            length L3                     X out of the plane (outward)
//          │╱        ╲
//     E_− ●            ● E_+  elbows R12', R12   (0, ±b2, c2)
//           ╲        ╱
//             ╲    ╱              links 1 and 1' cross
//       1       ╲╱         1'     length L1, rod ball at L2 from U, θ3 ahead of the elbow line
//             ╱    ╲
//    U_+  ●────A────● U_−  → Y    feet at y = −L5 (unprimed, s = +1) and y = +L5 (primed, s = −1);
//                                 base balls of the drives at y = +L4 (s = +1) and −L4 (s = −1)
//
// Used terms: (y, l) tip in the limb plane, Y_s = L5 + s y; q1, q2 angles of links 1, 2 from s·Y
// toward Z; q12 = q1 + θ3; R distance of the drive's balls. Synchronous drives: y = 0.
// Assumptions: rigid links; crossing assembly (minus root).
//
// (14) A_iB_i = °r_op + R_op ^pB_i − A_i,  l = |A_iB_i| when y = 0
// (17) λ = atan[e_r · (B − A)/(z_B − z_A)]          (printed: x of {o}, right for limb 1 only)
// (18, 19) L1 cos q1 + L3 cos q2 = Y_s,  L1 sin q1 + L3 sin q2 = l
// (20) q1 = 2 atan[(l − √(l² + Y_s² − C²))/(Y_s − C)],  C = −(Y_s² + L1² + l² − L3²)/(2 L1)
//      R = √[(L2 cos q12 − L5 − L4)² + (L2 sin q12)²]
// Rates, from (18), (19) differentiated once and twice ("four linear systems" of the paper):
// (a)  q1' = (cos q2 Y_s' + sin q2 l')/(L1 s12),  q2' = −(cos q1 Y_s' + sin q1 l')/(L3 s12)
// (b)  the same with Y_s'' + L1 q1'² cos q1 + L3 q2'² cos q2 and l'' + L1 q1'² sin q1 + L3 q2'²
//      sin q2 for the accelerations;  s12 = sin(q2 − q1)
// (c)  R' = k sin q12 q1'/R,  R'' = [k (cos q12 q1'² + sin q12 q1'') − R'²]/R,  k = L2 (L4 + L5)
// Limb rates, the short form of (16) (see equivalent_limb.h for the paper's):
// (d)  B' = v + ω × B,  B'' = a + ε × B + ω × B'  with (ω; v), (ε; a) = °V_op, °A_op
// (e)  l' = Z·B', λ' = X·B'/l, l'' = Z·B'' + l λ'², λ'' = (X·B'' − 2 l' λ')/l,  y' = Y·B'
#pragma once

#include <array>

#include "analytic/stabilizing_platform/parameters.h"
#include "analytic/stabilizing_platform/velocity.h"
#include "base/run_summary.h"
#include "math/profile.h"

namespace mbv::stabilizing_platform {

/// One side of a limb: links 1 and 2 and their drive.
struct SideMotion {
  Jet q1, q2;             ///< [rad], from s·Y toward Z
  Jet R;                  ///< drive length [m]
  double c1, s1, c2, s2;  ///< cosine and sine of q1, q2
  double c12, s12;        ///< cosine and sine of q12 = q1 + θ3
};

struct LimbMotion {
  Mat3 R_oA;                       ///< axes of {A_i} in {o}
  Vec3 p_oA, p_oB;                 ///< A_i and B_i in {o} [m]
  Vec3 v_oB, a_oB;                 ///< B', B'' relative to {o}, in {o}
  Jet length, tilt;                ///< l [m], λ [rad]
  Jet lateral;                     ///< y of the tip in {A_i} [m]; 0 when synchronous
  std::array<SideMotion, 2> side;  ///< unprimed, primed
};

/// How a limb's drives move: equal lengths (y = 0 by (5)) or independent of each other.
enum class DrivePairs { kSynchronous, kIndependent };

/// Constants of a limb's plane before it tilts.
struct LimbPlace {
  Vec3 e_r, e_t;    ///< radial and tangential unit vectors in {o}
  Vec3 p_oA, p_pB;  ///< A_i in {o}, B_i in {p}
  explicit LimbPlace(double azimuth = 0, double r_a = 0, double r_b = 0);
};

/// Solves one side for a tip at (Y_s, l) with rates. Fails with kUnreachable when the links are
/// too short or too long (amount: missing length [m]) and kSingular when they are stretched or
/// folded, or the drive's line passes through the foot.
[[nodiscard]] RunSummary ComputeSide(const PlatformParameters& p, const Jet& Y_s, const Jet& l,
                                     SideMotion* side);

/// (14)–(20) with rates for a limb (index 0…2, for messages). Fails as ComputeSide, and with
/// kSingular at and beyond the toggle, where links 2 and 2' lie in one line.
[[nodiscard]] RunSummary ComputeLimb(const PlatformParameters& p, int limb, const LimbPlace& place,
                                     const RelativeMotion& motion, DrivePairs pairs,
                                     LimbMotion* out);

/// dl/dR of a synchronous limb.
[[nodiscard]] double LengthPerDrive(const PlatformParameters& p, const SideMotion& side);

/// Amplification (l − l0)/(R − R0) of a synchronous limb, with its limit dl/dR at the neutral
/// pose (α = β = h = 0, height z_0).
class Amplification {
 public:
  explicit Amplification(const PlatformParameters& p);
  [[nodiscard]] double operator()(const LimbMotion& limb) const;
  [[nodiscard]] double neutral_length() const { return l_0_; }
  [[nodiscard]] double neutral_ratio() const { return ratio_0_; }

 private:
  PlatformParameters p_;
  double l_0_ = kNan, R_0_ = kNan, ratio_0_ = kNan;
};

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
