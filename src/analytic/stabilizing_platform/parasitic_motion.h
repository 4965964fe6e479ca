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
#pragma once

#include "analytic/stabilizing_platform/parameters.h"
#include "core/profile.h"
#include "core/run_summary.h"

namespace mbv::stabilizing_platform {

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
