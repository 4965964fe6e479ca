// Equation audit of the SCARA robot.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "analytic/scara_robot/dynamics.h"
#include "analytic/scara_robot/stiffness.h"
#include "features/equation_audit/audit.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

// Parts of the SCARA robot's equation audit [Zhu 2019].
//
// Truth is the generic reference solver on models/scara_robot: bodies, joints and loads only, no
// formula of the paper; for stiffness, frame elements on its elastic model. The states follow a
// fast closed path inside one quadrant of the workspace (up to 30 m/s², 150 rad/s²) under gravity,
// a force and a moment on the platform.

namespace mbv::scara_audit {

using scara_robot::kLimbs;
using scara_robot::Mat34;
using scara_robot::Mat4;
using scara_robot::Vec4;

/// A point's motion in world axes.
struct PointMotion {
  Vec3 p, v, a;
};

/// What the reference solver says about one limb.
struct LimbTruth {
  PointMotion A, C, D, B;      ///< D = B for limbs 3, 4
  PointMotion arm, rods;       ///< middle of the arm; mean of the rods' middles
  Vec3 omega_arm, domega_arm;  ///< [rad/s], [rad/s²]
  Vec3 omega_rod, domega_rod;  ///< both rods of a limb turn alike; the larger difference from
                               ///< this is kept in `rods_apart`
  double rods_apart = 0.0;
  Mat3 R_arm, R_rod;  ///< orientations; x along the arm, the rod
};

/// One state: commanded, solved, and the closed form's geometry at it.
struct State {
  double time_s = 0.0;
  Vec4 theta;                ///< drive angles of the reference solver
  scara_robot::Rates rates;  ///< X as commanded, θ as solved by the reference
  Vec4 M;                    ///< drive torques
  PointMotion P;             ///< platform
  Vec3 domega_platform;      ///< [rad/s²]
  double tilt = 0.0;         ///< angle of the platform's z axis from the world's [rad]
  std::array<LimbTruth, kLimbs> limbs;
  scara_robot::Position position;  ///< closed form at the commanded pose
  Mat4 J, J_inverse;               ///< closed form, (28)
};

/// External load of the sweep.
inline const Vec3 kForce(3.0, -2.0, -5.0);
inline constexpr double kMomentZ = 0.1;

/// Commanded pose and its derivatives at a time of the sweep.
struct PathPoint {
  Vec4 X, dX, ddX;
};
[[nodiscard]] PathPoint PathAt(double t_s);

/// The sweep's states.
[[nodiscard]] std::vector<State> Sweep(const Mechanism& mechanism);

/// Limit for quantities of the given scale: the reference solver closes its loops to 1e-13 m in
/// limbs of 0.1 m, magnified by 1/s_min ≤ 10 of the direct Jacobian.
[[nodiscard]] inline double Limit(double scale) { return 1e-11 * scale; }

/// Adds every component of a vector quantity to a row.
inline void AddAll(RowMeter* meter, const VecX& truth, const VecX& printed, const VecX& corrected) {
  for (Eigen::Index c = 0; c < truth.size(); ++c) {
    meter->Add(truth[c], printed[c], corrected[c]);
  }
}

/// Topology, Table 1, Eqs. (1)–(10), (22), (23), (49).
[[nodiscard]] std::vector<AuditRow> PositionRows(const Mechanism& mechanism,
                                                 const scara_robot::Parameters& parameters,
                                                 const std::vector<State>& states);
/// Eqs. (24)–(30).
[[nodiscard]] std::vector<AuditRow> VelocityRows(const scara_robot::Parameters& parameters,
                                                 const std::vector<State>& states);
/// Eqs. (31)–(41).
[[nodiscard]] std::vector<AuditRow> LinkRows(const scara_robot::Parameters& parameters,
                                             const std::vector<State>& states);
/// Eqs. (42)–(48).
[[nodiscard]] std::vector<AuditRow> DynamicsRows(const scara_robot::Parameters& parameters,
                                                 const std::vector<State>& states);
/// Eqs. (11)–(21) and the symmetry of Figs 9–11, on models_dir/scara_robot/elastic.yaml.
[[nodiscard]] std::vector<AuditRow> StiffnessRows(
    const std::string& models_dir, const scara_robot::StiffnessParameters& parameters);

}  // namespace mbv::scara_audit

namespace mbv {

/// Rows for Eqs. (1)–(10), (22)–(49), the DOF count and Table 1 of [Zhu 2019].
[[nodiscard]] AuditTable AuditScaraRobot(const std::string& models_dir);

}  // namespace mbv
