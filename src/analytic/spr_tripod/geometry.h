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
#pragma once

#include <array>

#include "core/diagnostics.h"
#include "core/types.h"
#include "mechanism/mechanism.h"

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

}  // namespace mbv::spr_tripod
