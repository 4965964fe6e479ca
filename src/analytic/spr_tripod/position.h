// Position of the 3-SPR mechanism: corrected (6c), (7c), inverse and forward problems.
//
// Assumptions: rigid bodies, no play; azimuths of the paper (see geometry.h).
//
// The paper describes the platform's orientation by z-x-z Euler angles, R = Rot(z,ψ) Rot(x,θ)
// Rot(z,δ). They are singular at θ = 0, where the mechanism spends its life, so everything here
// uses tilt coordinates with the corrected torsion δ = −ψ built in:
//
//   X = tan(θ/2) cos ψ,  Y = tan(θ/2) sin ψ,  D = 1 + X² + Y²
//               | 1+X²−Y²    2XY       2Y     |
//   R = (1/D) · |  2XY     1−X²+Y²    −2X     |
//               | −2Y        2X     1−X²−Y²   |
//
// The constraints c_i·(r − b_i) = 0, equation (2), then become u·r = b (v_y − u_x)/2 and
// v·r = b v_x, which is (6c). Multiplied by D they are two conics in X and Y:
//
//   E1 = (1+X²−Y²) x + 2XY y − 2Y z + b (X²−Y²) = 0
//   E2 = 2XY x + (1−X²+Y²) y + 2X z − 2b XY = 0                                          (6c')
#pragma once

#include <vector>

#include "analytic/spr_tripod/geometry.h"
#include "core/run_summary.h"

namespace mbv::spr_tripod {

/// Tilt coordinates: X = tan(θ/2) cos ψ, Y = tan(θ/2) sin ψ, with zero torsion (δ = −ψ).
struct Tilt {
  double X = 0.0, Y = 0.0;

  [[nodiscard]] Mat3 Rotation() const;   ///< R_WP, platform to world
  [[nodiscard]] double Angle() const;    ///< θ [rad], in [0, π)
  [[nodiscard]] double Azimuth() const;  ///< ψ [rad]; 0 where θ = 0
  static Tilt FromEuler(double psi, double theta);
};

/// A pose with everything that (1)–(8) define, in world axes.
struct Posture {
  Vec3 r = Vec3::Zero();
  Tilt tilt;
  Mat3 R = Mat3::Identity();
  PerLeg<Vec3> a, b, c, d, w;  ///< a_i, b_i, c_i, d_i = b_i − r, w_i
  PerLeg<double> q{};          ///< leg lengths [m]
};

/// (6c): x0 and y0 of O_A for a tilt (any angle below 90°) and a height z0 [m].
[[nodiscard]] Vec3 CentreOf(const Geometry& geometry, const Tilt& tilt, double z0);

/// (7c): squared leg lengths [m²] of a pose that meets the constraints.
[[nodiscard]] PerLeg<double> SquaredLengths(const Geometry& geometry, const Vec3& r, const Mat3& R);

/// (1), (5), (8): joint centres, leg directions and lengths. r and tilt must belong together.
void FillPosture(const Geometry& geometry, const Vec3& r, const Tilt& tilt, Posture* posture);

/// Inverse position problem: the home branch (δ = −ψ, w_z > 0) for O_A at r, by Newton on (6c').
/// kUnreachable below z = b/2, where several upright assemblies exist, or where no upright
/// assembly reaches r (`amount` tells by how much z is too small where that is the reason).
[[nodiscard]] RunSummary SolveInverse(const Geometry& geometry, const Vec3& r, Posture* posture);

/// Forward position problem: the home branch for leg lengths q [m], by Newton on |B_i A_i| = q_i
/// in (X, Y, z0) from the untilted pose. kUnreachable when three legs of these lengths do not
/// meet the platform.
[[nodiscard]] RunSummary SolveForward(const Geometry& geometry, const PerLeg<double>& q,
                                      Posture* posture, int* iterations = nullptr);

/// One of the mechanism's orientations for a given O_A.
struct Assembly {
  Mat3 R = Mat3::Identity();
  Tilt tilt;             ///< of R, or of R turned by π about w
  bool turned = false;   ///< true: δ = π − ψ (the platform turned by π about w)
  bool upright = false;  ///< w_z > 0
};

/// All real orientations with O_A at r: the common points of the two conics (6c'), each also
/// turned by π about w. Eight for every pose of the workspace; the home branch is the only one
/// with !turned && upright when r.z > b/2.
[[nodiscard]] std::vector<Assembly> AllAssemblies(const Geometry& geometry, const Vec3& r);

}  // namespace mbv::spr_tripod
