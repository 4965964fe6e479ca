// Motions of the lower platform {o} and the upper platform {p} [Li 2018, Eqs. 8–13].
//
//   {e} earth, z up      {s} ship: origin (0, 0, h), R_es = Rx(α) Ry(β)
//   {o} lower platform: R_eo = R_es, origin at (0, 0, s_r_so) of {s}      {p} upper platform
//
// Used terms: ω, ε angular velocity and acceleration; v_q, a_q velocity and acceleration of the
// point q. A twist V = [ω; v] has in v the velocity of the body point at the origin of the frame
// it is expressed in, and a twist's acceleration A is its plain time derivative (spatial
// acceleration), so that both transform with Ad(g).
//
// (8)  V_ep = [ω; v_p − ω × r_ep]          (9)  A_ep = [ε; a_p − ε × r_ep − ω × v_p]
//      (parasitic motion: ω = γ' e_z, v_p = (x', y', z'), and so on)
// (10) V_eo = [ω; v_o − ω × r_eo]          (11) A_eo = [ε; a_o − ε × r_eo − ω × v_o]
//      ω_eo = α' e_x + β' e_y',  e_y' = Rx(α) e_y,  ε_eo = α'' e_x + β'' e_y' + α' β' e_x × e_y'
//      v_o = h' e_z + ω × r_so,  a_o = h'' e_z + ε × r_so + ω × (ω × r_so)
// (12) V_ep = V_eo + Ad(g_eo) °V_op
// (13) A_ep = A_eo + Ad(g_eo) °A_op + [V_eo, Ad(g_eo) °V_op]
#pragma once

#include <array>

#include "analytic/stabilizing_platform/parameters.h"
#include "base/run_summary.h"
#include "base/types.h"
#include "math/profile.h"

namespace mbv::stabilizing_platform {

/// Pose and motion of a body frame B in the earth frame E; all vectors in E.
struct FrameMotion {
  Mat3 R_EB = Mat3::Identity();
  Vec3 p_EB = Vec3::Zero();
  Vec3 v = Vec3::Zero(), a = Vec3::Zero();            ///< of B's origin [m/s, m/s²]
  Vec3 omega = Vec3::Zero(), epsilon = Vec3::Zero();  ///< [rad/s, rad/s²]
};

/// The lower platform under the ship's roll, pitch [rad] and heave [m] (below (10) and (11)).
[[nodiscard]] FrameMotion LowerPlatformMotion(const Jet& roll, const Jet& pitch, const Jet& heave,
                                              double s_r_so);
/// The upper platform from its position and roll, pitch, yaw (R = Rz Ry Rx) in the earth frame.
[[nodiscard]] FrameMotion UpperPlatformMotion(const std::array<Jet, 6>& xyz_rpy);

/// (8), (10): the twist about the earth's origin.
[[nodiscard]] Vec6 TwistOf(const FrameMotion& motion);
/// (9), (11): the spatial acceleration about the earth's origin.
[[nodiscard]] Vec6 SpatialAccelerationOf(const FrameMotion& motion);

/// What the closed form needs of both platforms, all expressed in {o} about {o}'s origin.
struct RelativeMotion {
  Mat3 R_op = Mat3::Identity();
  Vec3 p_op = Vec3::Zero();
  Vec6 V_op = Vec6::Zero(), A_op = Vec6::Zero();  ///< of {p} relative to {o}, (12), (13)
  Vec6 V_eo = Vec6::Zero(), A_eo = Vec6::Zero();  ///< of {o} relative to the earth
  Vec6 V_ep = Vec6::Zero(), A_ep = Vec6::Zero();  ///< of {p} relative to the earth
  Vec3 gravity = Vec3::Zero();                    ///< R_oe (0, 0, −g) [m/s²]
};

/// (12), (13), solved for the relative twist and acceleration.
[[nodiscard]] RelativeMotion ComputeRelativeMotion(const FrameMotion& lower,
                                                   const FrameMotion& upper, double g);

/// [V1, V2] = ad(V1) V2.
[[nodiscard]] inline Vec6 Bracket(const Vec6& V1, const Vec6& V2) {
  Vec6 out;
  out << V1.head<3>().cross(V2.head<3>()),
      V1.tail<3>().cross(V2.head<3>()) + V1.head<3>().cross(V2.tail<3>());
  return out;
}

// Parasitic motion of the upper platform [Li 2018, Eqs. 3–7].
//
// The platform is held level at a given height over the earth while the ship rolls and pitches.
// Each synchronous limb keeps its tip B_i in the radial plane of its foot A_i, which fixes the
// platform's sway x, y and yaw γ:
//
//            z ↑   p ───────── level, height z0        limb plane i contains z_o and A_i B_i:
//              │  ╱B_i                                 e_t,i · (B_i − A_i) = 0              (3, 4)
//     o ───────┼── A_i  rolled α, pitched β, heaved h
//              e
//
// Used terms: α roll, β pitch, ζ = z0 − h height of p over the ship's origin (the paper's z0 is
// constant, ζ' = −h'; here z0 may move too), γ yaw, δ = γ + θ2, θ1, θ2 azimuths of limbs 2, 3,
// r_b radius of the B_i circle; c, s, t of an angle are its cosine, sine, tangent.
// Assumptions: platform level (roll = pitch = 0 in the earth frame), drives of a limb equal.
//
// (5)  γ = atan[(u1 (cβ − cα) + u2 sα sβ) / (u3 cα + u2 cβ − u1 sα sβ)]
//      y = −tα ζ − r_b sγ
//      x = tβ/cα ζ − r_b cδ + r_b (cα − sα sβ tθ2)(sδ − sγ)/(cβ tθ2)
//      u1 = sθ1 tθ2 − sθ2 tθ1,  u2 = tθ1 tθ2 (sθ1 − sθ2),  u3 = tθ1 (1 − cθ2) − tθ2 (1 − cθ1)
// (6)  γ' = (α' W1 + β' W2)/U
//      y' = −(1 + tα²) ζ α' − tα ζ' − r_b cγ γ'
//      x' = L α' + M β' + N γ' + tβ/cα ζ'
//      W1 = w1 sα cβ + w2 cα sβ cβ + w3 sβ
//      W2 = −w1 cα sβ + w2 sα + w3 sα cα cβ
//      U  = w2 (1 − cα² sβ²) + w4 cα² + 2 w3 cα cβ − 2 w1 sα cα sβ
//      w1 = u1 (u2 + u3), w2 = u1² + u2², w3 = u2 u3 − u1², w4 = u1² + u3²   (w4 is not printed)
//      L  = tα tβ ζ/cα + r_b (sδ − sγ)(−sα/(cβ tθ2) − cα tβ)
//      M  = (1 + tβ²)/cα ζ + r_b (sδ − sγ)[+ cα tβ/(cβ tθ2) − (1 + tβ²) sα]   (printed: − cα tβ)
//      N  = r_b sδ + r_b (cδ − cγ)(cα/(cβ tθ2) − tβ sα)
// (7)  time derivatives of (6)

/// Sway and yaw of the platform in the earth frame [m, rad], with two derivatives.
struct ParasiticMotion {
  Jet x, y, yaw;
};

/// Which sign the term cα tβ/(cβ tθ2) of M has; the print's leads to wrong x' and x''.
enum class SignInM { kCorrected, kPrinted };

/// Equations (5)–(7). `roll`, `pitch` [rad] are the ship's, `height` [m] is z0 − h. Fails with
/// kSingular at 90° of roll or pitch and where the denominators of (5) or (6) vanish.
[[nodiscard]] RunSummary ComputeParasiticMotion(const PlatformParameters& p, const Jet& roll,
                                                const Jet& pitch, const Jet& height, SignInM sign,
                                                ParasiticMotion* motion);

}  // namespace mbv::stabilizing_platform
