// The fastest rate at which springs, dampers and servos let a mechanism vibrate or creep, and the
// step that can follow it.
//
// With N the motions that all constraints leave (J N = 0), small motions q̇ = N x obey
//   M_N ẍ + C_N ẋ + K_N x = 0,   A_N = Nᵀ A N,
//   K = Σ k u uᵀ, C = Σ c u uᵀ   (u: gradient of a spring's length or of a servo's coordinate)  (1)
// and the rates are |λ| of [0 I; −M_N⁻¹K_N −M_N⁻¹C_N].                                        (2)
// The fourth-order scheme lets a mode drift, as measured on one spring, by about
//   1e-3 (|λ| h)⁴ |λ| min(T, 1/|Re λ|)                                                        (3)
// of its amplitude over a motion of length T.
// Geometric stiffness (loads, gravity) is left out: it is slow beside what is asked for here.
#pragma once

#include <numbers>
#include <string>

#include "simulation/engine/constraint_system.h"
#include "simulation/engine/simulation.h"

namespace mbv::simulation {

struct FastestRate {
  double per_s = 0.0;  ///< |λ| [1/s]; 0 without springs and servos, or where nothing is free
  std::string part;    ///< spring or drive that has most of it
  /// (3) over h⁴ of the mode that drifts most [1/s⁴], and its rate and part.
  double drift = 0.0, drift_per_s = 0.0;
  std::string drift_part;
};

/// At the data's configuration, whose position stage is evaluated.
[[nodiscard]] FastestRate FastestRateOf(const ConstraintSystem& system, const ServoGains& servo,
                                        double duration_s);

/// Steps per period (2π over the rate) below which the scheme is not stable, and the drift (3)
/// above which a step is reported as too coarse.
inline constexpr double kLeastStepsPerPeriod = 4.0 * std::numbers::pi, kMostDrift = 1e-5;

}  // namespace mbv::simulation
