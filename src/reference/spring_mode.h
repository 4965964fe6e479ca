// How fast springs, dampers and force elements let a mechanism vibrate or creep, and what following
// that costs. Internal to reference/.
//
// With R the motions that all constraints leave, small motions V = R x obey
//   RᵀMR ẍ + RᵀCR ẋ + RᵀKR x = 0,  K = Σ k u uᵀ, C = Σ c u uᵀ  (u: gradient of a part's coordinate)
// and the rates are |λ| of [0 I; −(RᵀMR)⁻¹RᵀKR −(RᵀMR)⁻¹RᵀCR]. Geometric stiffness is left out.
#pragma once

#include <string>

#include "kinematics/constraints.h"
#include "mechanism/mechanism.h"

namespace mbv::internal {

/// The fastest of a mechanism's spring modes.
struct SpringMode {
  double rate_per_s = 0.0;   ///< |λ|; 0 without springs, or where nothing is free
  double decay_per_s = 0.0;  ///< −Re λ: the amplitude falls as exp(−decay t)
  std::string spring;        ///< or force element that has most of its energy
};

/// At a pose; `motions` (6·bodies × freedoms) is a basis of what the constraints leave there.
[[nodiscard]] SpringMode FastestSpringMode(const Mechanism& mechanism, const BodyStates& states,
                                           const MatX& motions);

/// Steps that an error-controlled integration of order 7(8) needs to follow the mode for `ahead_s`
/// when its steps are `step_s` now: they cover a fixed angle while the mode rings, and grow by the
/// seventh root as it fades, until they are as long as is stable. 0 where it is not the mode that
/// makes the steps short.
[[nodiscard]] double StepsToFollow(const SpringMode& mode, double step_s, double ahead_s);

}  // namespace mbv::internal
