// Audit of the stabilizing platform's equations [Li 2018].
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analytic/stabilizing_platform/dynamics.h"
#include "features/equation_audit/audit.h"
#include "mechanism/mechanism.h"
#include "reference/reference.h"

// Shared parts of the stabilizing platform's audit: independent truth and row helpers.
//
// Truth is the generic reference solver on the model file: body poses closed by Newton, twists and
// accelerations from constraint Jacobians, forces from maximal-coordinate Newton–Euler. It shares
// no formula with the paper. What the reference does not give as such (spatial accelerations, which
// are time derivatives of twists) comes from sixth-order differences of the reference's twists.

namespace mbv::platform_audit {

namespace sp = stabilizing_platform;

/// The default motion: roll 6° sin(2πt/6), pitch 3° sin(2πt/4), heave 1.5 m sin(2πt/6).
[[nodiscard]] Motion SeaState(const Mechanism& mechanism);
[[nodiscard]] sp::PoseCommand SeaStateAt(double t_s);

/// One side of a limb as the reference sees it, angles from s·Y toward Z.
struct SideTruth {
  double q1 = kNan, q2 = kNan, q1_rate = kNan, q2_rate = kNan;
  Jet R;
  Vec3 elbow_A;  ///< in {A_i} [m]
};

/// One limb as the reference sees it.
struct LimbTruth {
  Mat3 R_oA;        ///< axes of the limb plane in {o}, X = axis of the link's U joint
  Vec3 p_oA, p_oB;  ///< foot circle point and tip of link 2, in {o}
  double l = kNan, l_rate = kNan, l_acceleration = kNan;
  double tilt = kNan, tilt_rate = kNan;
  std::array<SideTruth, 2> side;
  std::array<Vec6, 4> link_twist_A;  ///< of links 1, 1', 2, 2' relative to {o}, in {A_i} about A_i
  Vec3 force_A;                      ///< of the limb on the platform, in {A_i} [N]
  std::array<double, 2> drive;       ///< thrust [N]
};

/// One instant.
struct Truth {
  double time_s = kNan;
  sp::PoseCommand command;
  Pose X_eo, X_ep;
  Vec6 motion_o, motion_p;              ///< [ω; v of the origin] in the earth frame
  Vec6 acceleration_o, acceleration_p;  ///< [ε; a of the origin]
  Vec6 V_eo, V_ep;                      ///< twists about the earth's origin
  Vec6 A_eo, A_ep;                      ///< their time derivatives (differences)
  Vec6 V_op, A_op;                      ///< relative twist in {o} and its derivative (differences)
  std::array<LimbTruth, 3> limbs;
};

/// A loaded model, its truth at 61 instants of a period, and the closed form at the same instants.
struct Case {
  Mechanism mechanism;
  sp::PlatformParameters parameters;
  std::vector<Truth> truth;
  std::vector<sp::Evaluation> closed;  ///< corrected equations
};

/// `link_mass_scale` 1: full masses; 0: massless links.
[[nodiscard]] Case MakeCase(const std::string& models_dir, double link_mass_scale);

// Limits. Newton leaves roundoff of lengths near 10 m (2e-15 m); tips follow drives by up to
// dl/dR = 5, angles near the toggle by another 10, and rates are up to 2.6 m/s: three digits more.
// Differences divide by their step of 5 ms. Forces reach 1.2 MN (roundoff 3e-10 N) in systems of
// condition up to a few hundred.
inline constexpr double kPositionLimit = 1e-12;    // m, rad
inline constexpr double kRateLimit = 1e-12;        // m/s, rad/s, m/s², rad/s²
inline constexpr double kDifferenceLimit = 1e-10;  // m/s², rad/s²
inline constexpr double kForceLimit = 1e-6;        // N, N m

[[nodiscard]] std::vector<AuditRow> PoseRows(const Case& full);   // (1)–(7)
[[nodiscard]] std::vector<AuditRow> TwistRows(const Case& full);  // (8)–(16)
[[nodiscard]] std::vector<AuditRow> LimbRows(const Case& full);   // (17)–(20) and rates
[[nodiscard]] std::vector<AuditRow> ForceRows(const Case& full, const Case& massless);  // (21)–
[[nodiscard]] std::vector<AuditRow> ClaimRows(const Case& full, const Case& massless);  // E9–E12

}  // namespace mbv::platform_audit

namespace mbv {

/// One row or more for each of (1)–(22), the 30 equations of a limb and the errata E1–E12, at 61
/// instants of the paper's example motion. Demands that the shipped model loads and runs.
[[nodiscard]] AuditTable AuditStabilizingPlatform(const std::string& models_dir);

}  // namespace mbv
