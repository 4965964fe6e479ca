// The 3-SPR mechanism's equation audit [Mei 2012].
//
// Truth is the generic reference solver on models/spr_tripod: bodies, joints, masses and loads, no
// formula of the paper. One fast closed path is sampled (tilts of 10 … 20 deg, never zero, so that
// the paper's Euler angles exist; up to 1.5 m/s) with lateral centre-of-mass offsets, inclined
// gravity and a load on the platform, so that no symmetry hides an error.
#pragma once

#include <string>
#include <vector>

#include "analytic/spr_tripod/dynamics.h"
#include "features/equation_audit/audit.h"

namespace mbv {

/// Rows for every numbered equation, the path law, the example's data, and the extension.
[[nodiscard]] AuditTable AuditSprTripod(const std::string& models_dir);

namespace spr_tripod_audit {

using spr_tripod::PerLeg;

/// One leg as the reference solver sees it, world axes.
struct LegTruth {
  Vec3 A, B;              ///< origins of rod and cylinder [m]
  Vec3 w, c;              ///< axis of the slide, axis of the hinge on the rod
  Vec3 v_A;               ///< [m/s]
  Vec3 omega, omega_dot;  ///< of the rod
  double q = kNan, q_dot = kNan, q_ddot = kNan;
  double f = kNan;  ///< drive force [N]
  Vec3 S;           ///< force of the base on the cylinder [N]
};

/// One instant.
struct Truth {
  Vec3 r, v, v_dot;                               ///< of O_A
  Vec3 omega, omega_dot;                          ///< of the platform
  Mat3 R;                                         ///< of the platform
  double psi = kNan, theta = kNan, delta = kNan;  ///< z-x-z angles of R
  PerLeg<LegTruth> leg;
};

/// The same instant in closed form, corrected equations.
struct Closed {
  spr_tripod::Posture p;
  spr_tripod::Jacobians j;
  spr_tripod::Velocities v;
  spr_tripod::Accelerations a;
  spr_tripod::Forces f;
};

struct Case {
  spr_tripod::Geometry geometry;
  std::vector<Truth> truth;
  std::vector<Closed> closed;
};

[[nodiscard]] Case MakeCase(const std::string& models_dir);

// Limits. The reference closes its loops to 1e-13 m in bodies of 1 m size; angles follow with a
// factor below 5. Rates come from its constraint Jacobian (condition below 100) at 2.4 m/s,
// accelerations likewise at 31 m/s², forces of 0.9 kN from a system of condition 1e4.
inline constexpr double kPositionLimit = 1e-12;      // m, rad
inline constexpr double kRateLimit = 1e-12;          // m/s, rad/s
inline constexpr double kAccelerationLimit = 1e-11;  // m/s², rad/s²
inline constexpr double kForceLimit = 1e-9;          // N

[[nodiscard]] std::vector<AuditRow> PositionRows(const Case& c);  // (1)–(10)
[[nodiscard]] std::vector<AuditRow> VelocityRows(const Case& c);  // (11)–(20)
[[nodiscard]] std::vector<AuditRow> PathRows(const Case& c);      // (21), (22), Table 1, workspace
[[nodiscard]] std::vector<AuditRow> DynamicsRows(const Case& c);  // (D1)–(D12)

}  // namespace spr_tripod_audit
}  // namespace mbv
