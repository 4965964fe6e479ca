// The fastest rate at which springs, dampers and servos let a mechanism vibrate or creep, and the
// step that can follow it.
//
// With N the motions that all constraints leave (J N = 0), small motions q̇ = N x obey
//   M_N ẍ + C_N ẋ + K_N x = 0,   A_N = Nᵀ A N,
//   K = Σ k u uᵀ, C = Σ c u uᵀ   (u: gradient of a spring's length or of a servo's coordinate)  (1)
// and the rates are |λ| of [0 I; −M_N⁻¹K_N −M_N⁻¹C_N].                                        (2)
// Geometric stiffness (loads, gravity) is left out: it is slow beside what is asked for here.
#pragma once

#include <numbers>
#include <string>

#include "simulation/constraint_system.h"
#include "simulation/simulation.h"

namespace mbv::simulation {

struct FastestRate {
  double per_s = 0.0;  ///< |λ| [1/s]; 0 without springs and servos, or where nothing is free
  std::string part;    ///< spring or drive that has most of it
};

/// At the data's configuration, whose position stage is evaluated.
[[nodiscard]] FastestRate FastestRateOf(const ConstraintSystem& system, const ServoGains& servo);

/// Steps per period (2π over the rate) that the fourth-order scheme wants, and at least needs.
inline constexpr double kStepsPerPeriod = 30.0, kLeastStepsPerPeriod = 2.0 * std::numbers::pi;

}  // namespace mbv::simulation
