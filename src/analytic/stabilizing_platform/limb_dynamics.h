// Forces in a modified-scissors limb, in closed form [Li 2018, section 3, corrected].
//
//              f_Z ↑  f_X out of the plane            force of the limb on the platform at B
//                  B ──► f_Y
//          P_− ↙      ↘ P_+                           P_s: force on link 2 of side s at B (from
//             2'      2                               the platform's ball and the other link 2)
//           E_−        E_+
//             1 ╲    ╱ 1'                             drive_s: thrust along n_s at rod ball b_s
//          U_+ ●  A   ● U_−
//
// Used terms: everything in {A_i}, moments about A_i unless a point is named. Required wrench of a
// link [m; f]: what joints and drives must exert on it, inertia minus gravity minus external loads,
// the paper's N A − ad(V)ᵀ N V − W^G. a × b of in-plane vectors is a_Y b_Z − a_Z b_Y. "2" and
// "1+2" mean link 2 and links 1 and 2 of one side together.
// Assumptions: massless drives; no friction; R22' transmits a force only (isostatic rule: the two
// redundant constraints of the closed five-bar loop carry nothing).
//
// (a) ω = ω_A + s q' X,  ε = ε_A + s q'' X + ω_A × s q' X,
//     a_c = a_A + ε_A × c + ω_A × (ω_A × c) + 2 ω_A × c' + c''      (limb plane moving with A)
// (b) f = m (a_c − g),  m = I ε + ω × I ω + c × f                    required wrench
// (c) P_s,X = M_Y,(1+2),s / l,   f_X = −(P_+,X + P_−,X)              (missing in the print)
// (d) (B − E_s) × P_s = m_X,2,s − E_s × f_2,s;   P_+ + P_− = −(f_Y, f_Z)
// (e) drive_s = [m_X,(1+2),s − U_s × f_(1+2),s − (B − U_s) × P_s] / [(b_s − U_s) × n_s],
//     (b_s − U_s) × n_s = s (L4 + L5) L2 sin q12 / R
// (f) elbow: f_2 − P_s, moment about E; foot: f_(1+2) − P_s − drive_s n_s, moment about U
#pragma once

#include <array>

#include "analytic/stabilizing_platform/limb_kinematics.h"

namespace mbv::stabilizing_platform {

/// Points and axes of a limb's links in {A_i}.
struct LimbGeometry {
  Vec3 B;                        ///< tip
  std::array<Vec3, 2> U, E;      ///< feet and elbows per side
  std::array<Vec3, 2> d1, d2;    ///< unit vectors along links 1 and 2
  std::array<Vec3, 2> rod_ball;  ///< b_s
  std::array<Vec3, 2> thrust;    ///< n_s, from base ball to rod ball

  [[nodiscard]] const Vec3& origin(int link) const {  ///< origin of a link's frame
    return link < kLink2 ? U[link] : E[link - kLink2];
  }
  [[nodiscard]] Mat3 R_AL(int link) const;  ///< axes of a link's frame in {A_i}
};
[[nodiscard]] LimbGeometry GeometryOf(const PlatformParameters& p, const LimbMotion& limb);

/// Required wrenches of the four links, [m; f] about A_i in {A_i}, by (a) and (b), without loads.
using LinkWrenches = std::array<Vec6, 4>;
void RequiredWrenches(const PlatformParameters& p, const LimbMotion& limb,
                      const LimbGeometry& geometry, const RelativeMotion& motion,
                      LinkWrenches* required);

/// (c): force along X of the limb on the platform [N].
[[nodiscard]] double OutOfPlaneForce(const LinkWrenches& required, double length);

/// Forces of a limb once its force on the platform is known.
struct LimbForces {
  Vec3 on_platform;             ///< (f_X, f_Y, f_Z) at B, in {A_i} [N]
  std::array<Vec3, 2> P;        ///< on link 2 of each side at B [N]
  std::array<double, 2> drive;  ///< thrust [N]
};

/// (d) and (e). `on_platform` must be set. Fails with kSingular at the toggle.
[[nodiscard]] RunSummary SolveLimb(const PlatformParameters& p, const LimbMotion& limb,
                                   const LimbGeometry& geometry, const LinkWrenches& required,
                                   LimbForces* forces);

/// Joint reactions: wrench [m; f] about the joint's centre in {A_i}, base on link 1 and link 1 on
/// link 2, drive forces excluded, by (f).
struct LimbReactions {
  std::array<Vec6, 2> foot;   ///< U1, U1'
  std::array<Vec6, 2> elbow;  ///< R12, R12'
};
[[nodiscard]] LimbReactions ReactionsOf(const LimbGeometry& geometry, const LinkWrenches& required,
                                        const LimbForces& forces);

}  // namespace mbv::stabilizing_platform
