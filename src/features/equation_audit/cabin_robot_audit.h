// Parts of the cabin robot's equation audit [Liu 2025].
#pragma once

#include <functional>
#include <random>
#include <string>
#include <vector>

#include "analytic/cabin_robot/stiffness.h"
#include "base/types.h"
#include "features/equation_audit/audit.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// All rows of the cabin robot; `models_dir` holds cabin_robot/model.yaml.
[[nodiscard]] AuditTable AuditCabinRobot(const std::string& models_dir);

}  // namespace mbv

namespace mbv::cabin_audit {

/// Sixth-order central differences of a vector function of time, step h.
template <typename F>
auto FirstDifference(const F& f, double h) {
  using V = decltype(f(0.0));
  return V((45.0 * (f(h) - f(-h)) - 9.0 * (f(2 * h) - f(-2 * h)) + (f(3 * h) - f(-3 * h))) /
           (60.0 * h));
}
template <typename F>
auto SecondDifference(const F& f, double h) {
  using V = decltype(f(0.0));
  return V((270.0 * (f(h) + f(-h)) - 27.0 * (f(2 * h) + f(-2 * h)) + 2.0 * (f(3 * h) + f(-3 * h)) -
            490.0 * f(0.0)) /
           (180.0 * h * h));
}

struct Lengths {
  double L1, L2, L3, L4, a2, d3, a3, a4, d6;
};
[[nodiscard]] Lengths LengthsOf(const Mechanism& mechanism);

// Each takes what the equations are given and what the independent computation is given: the same,
// unless a test perturbs one of them.

/// Equations (1)–(4), (8), (9): positions of the planar linkage.
[[nodiscard]] std::vector<AuditRow> PositionRows(const Lengths& lengths, const Lengths& truth);
/// Equations (14)–(25), (35)–(40): velocities, Jacobian and accelerations of the planar linkage.
[[nodiscard]] std::vector<AuditRow> VelocityRows(const Lengths& lengths, const Lengths& truth);
/// Equations (5)–(7), (10)–(13), (26)–(34), (41)–(46): wrist and complete chain.
[[nodiscard]] std::vector<AuditRow> WristRows(const Lengths& lengths, const Lengths& truth);
/// Equations (47)–(53): dynamics, against the generic reference solver.
[[nodiscard]] std::vector<AuditRow> DynamicsRows(const Mechanism& mechanism,
                                                 const Mechanism& truth);
/// Equations (54)–(75) and Table 2, against frame elements; `models_dir` holds
/// cabin_robot/elastic.yaml.
[[nodiscard]] std::vector<AuditRow> StiffnessRows(
    const std::string& models_dir, const cabin_robot::StiffnessParameters& parameters);

// The planar linkage closed by Newton's method on its five pin positions: the audit's independent
// computation. No angle and no formula of the paper enters; only the rod lengths.

using Vec2 = Eigen::Vector2d;

/// Pins of the linkage in the carriage frame.
struct Pins {
  Vec2 A, B, C, D, E, F;
  [[nodiscard]] double alpha() const { return std::atan2(B.y() - A.y(), B.x() - A.x()); }
  [[nodiscard]] double gamma() const { return std::atan2(C.y() - B.y(), C.x() - B.x()); }
  [[nodiscard]] double beta() const { return std::atan2(C.y(), D.x() - C.x()); }
  [[nodiscard]] double epsilon() const { return std::atan2(E.y(), F.x() - E.x()); }
  [[nodiscard]] Vec2 K() const { return 0.5 * (B + C); }
};

/// A pose of the sliders with constant accelerations: X(t) = x + v t + a t²/2.
struct SliderMotion {
  Vec3 x, v, a;  ///< sliders A, D, F
  Pins start;
};

/// Pins at time t of the motion, by Newton from the start pose.
[[nodiscard]] Pins Close(const Lengths& lengths, const SliderMotion& motion, double t);

/// Seeded random motions around regular poses of the workspace.
[[nodiscard]] std::vector<SliderMotion> RandomMotions(const Lengths& lengths, int count);

}  // namespace mbv::cabin_audit
