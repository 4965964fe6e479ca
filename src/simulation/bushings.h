// Bushings on MuJoCo's own bodies: one of the six coordinates between frames F and M (Bushing).
//
// With q = (w, v) the unit quaternion of R_FM, w >= 0, and n = |v|:
//   φ = θ v/n, θ = 2 atan2(n, w)                                                               (1)
//   φ̇ = T ω_FM,  T = ½ (θ/n) (w − [v]×) + v vᵀ (1 − θ w/(2n))/n²                               (2)
// from q̇ = ½ ω_FM q, the angular velocity in F's axes.
#pragma once

#include "simulation/constraint_system.h"

namespace mbv::simulation {

struct ElementMotion;

/// What a unit force along the coordinate does to the child at M's origin, world axes; the opposite
/// to the parent at the same place.
struct BushingLine {
  double value = 0.0;                             ///< of the coordinate [m or rad]
  Vec3 p_WM = Vec3::Zero();                       ///< [m]
  Vec3 push = Vec3::Zero(), turn = Vec3::Zero();  ///< force, moment
};
/// Of an element of a bushing at the data's position.
[[nodiscard]] BushingLine BushingLineOf(const ConstraintSystem& system, size_t element);
/// dq/dq̇ of MuJoCo's velocities (nv).
[[nodiscard]] VecX BushingGradient(const ConstraintSystem& system, size_t element);
/// Position and rate at the data's qpos and qvel; the acceleration is NaN.
[[nodiscard]] ElementMotion BushingMotionOf(const ConstraintSystem& system, size_t element);

}  // namespace mbv::simulation
