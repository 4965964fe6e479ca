// Wrench balance of the upper platform [Li 2018, Eqs. 21, 22].
//
// Used terms: everything in {o}, moments about {o}'s origin; B_i tip of limb i, X_i, Y_i, Z_i axes
// of {A_i}; f_i, f_{3+i}, f_X,i forces of limb i on the platform along Z_i, Y_i, X_i; N spatial
// inertia of the platform; r_c its centre of mass (at p in the paper); W^I wrench of inertia, W^G
// of gravity, W^E of external loads.
// Assumptions: balls at the tips (no moments).
//
// (21) [S1 … S6] f = −W^G − W^I − W^E − Σ f_X,i (B_i × X_i ; X_i),
//      S_i = (B_i × Z_i ; Z_i),  S_{3+i} = (B_i × Y_i ; Y_i)       (the print lacks f_X,i)
// (22) W^I = −(N A_ep − ad(V_ep)ᵀ N V_ep),  W^G = (r_c × m g ; m g)
#pragma once

#include <array>

#include "analytic/stabilizing_platform/limb_kinematics.h"

namespace mbv::stabilizing_platform {

/// W^I of (22).
[[nodiscard]] Vec6 InertiaWrench(const PlatformParameters& p, const RelativeMotion& motion);
/// W^G of (22).
[[nodiscard]] Vec6 GravityWrench(const PlatformParameters& p, const RelativeMotion& motion);

/// Solves (21) for f = (f_1 … f_6) [N]. `load` is W^E; `f_X` the forces along X (zero as printed).
/// Fails with kSingular when the six lines are dependent.
[[nodiscard]] RunSummary SolvePlatform(const PlatformParameters& p, const RelativeMotion& motion,
                                       const std::array<LimbMotion, 3>& limbs, const Vec3& f_X,
                                       const Vec6& load, Vec6* f);

}  // namespace mbv::stabilizing_platform
