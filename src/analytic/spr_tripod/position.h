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

#include <array>
#include <vector>

#include "base/diagnostics.h"
#include "base/run_summary.h"
#include "base/types.h"
#include "mechanism/mechanism.h"

// Dimensions, masses and frames of the 3-SPR mechanism.
//
//        B3           base plate, balls S at B_i on a circle of radius b about O_B
//       /  \          (frame O_B xyz = world: x through B3, z towards the platform, here downwards)
//     B1 -- B2
//      |    |         legs of length q_i, w_i from B_i to A_i (actuated slide P)
//     A1 -- A2
//       \  /          platform, hinges R at A_i on a circle of radius a about O_A
//        A3           (frame O_A uvw: u through A3, w normal)
//
// Used terms
//   r, v, v̇      position, velocity, acceleration of O_A, in world axes
//   R = [u v w]   platform to world;  a_i = a R f_i = p_OaAi_W,  b_i = b f_i = p_ObBi_W
//   c_i           unit vector of hinge i, fixed in the platform, tangential
//   d_i           a_i − q_i w_i = b_i − r = p_OaBi_W
//   leg frame     R_i = [c_i, w_i × c_i, w_i]; origin B_i for the cylinder, A_i for the rod
//   q_i           leg length = drive position; the drive's force f_i > 0 pushes A_i from B_i
// All vectors are in world axes unless the name says otherwise.
//
// Reference [Mei 2012]: Mei J., Gao B., Tan Y., Wang L.: Kinematic Analysis of 3-SPR Parallel
// Mechanism. Transactions of the Chinese Society for Agricultural Machinery 43 (8), 2012, 215–220.
// Numbers (1)…(22) are the paper's; (6c), (7c), (20c) are corrected forms; (D1)…(D12), dynamics,
// are an extension, for the paper stops at velocities.

namespace mbv::spr_tripod {

template <typename T>
using PerLeg = std::array<T, 3>;

/// Dimensions [m] and directions. The azimuths are the paper's: φ = 120°, −120°, 0 and
/// θ_i = φ_i ± 90°, since the corrected closed forms (6c), (7c) hold for these only.
struct Geometry {
  double a = 0.210;  ///< circumradius of the platform's hinges [m], > 0
  double b = 0.455;  ///< circumradius of the base's balls [m], > 0
  PerLeg<Vec3> f = {Vec3::UnitX(), Vec3::UnitX(), Vec3::UnitX()};  ///< (cos φ_i, sin φ_i, 0)
  PerLeg<Vec3> c = {Vec3::UnitY(), Vec3::UnitY(), Vec3::UnitY()};  ///< hinges in platform axes
  double q_min = 0.5, q_max = 0.75;                                ///< stroke [m]
};

/// Geometry with the paper's azimuths, hinge senses included (θ = 30°, 150°, 90°).
[[nodiscard]] Geometry PaperGeometry(double a = 0.210, double b = 0.455);

struct Inertia {
  double mass = 0.0;        ///< [kg]
  Vec3 com = Vec3::Zero();  ///< from the body's origin, body axes [m]
  Mat3 I = Mat3::Zero();    ///< about the centre of mass, body axes [kg m²]
};

struct Masses {
  Inertia platform;             ///< origin O_A, axes u v w
  Inertia cylinder;             ///< origin B_i, leg axes
  Inertia rod;                  ///< origin A_i, leg axes
  Vec3 gravity = {0, 0, 9.81};  ///< [m/s²]; z points from base to platform, here down
};

/// Reads a, b, phi_1…3, theta_1…3, q_min, q_max. Adds an error for each value that the closed
/// form does not cover (lengths not positive, azimuths other than the paper's).
[[nodiscard]] Geometry ReadGeometry(const Mechanism& mechanism, Diagnostics* diagnostics);

/// Reads m_X, c_X_x…z, I_X_xx…zz (and the products I_X_xy, I_X_xz, I_X_yz where they exist) for
/// X = platform, cyl, rod. Gravity is the mechanism's.
[[nodiscard]] Masses ReadMasses(const Mechanism& mechanism, Diagnostics* diagnostics);

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
/// assembly reaches r (`amount`: by how much z is too small, where that is the reason).
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
