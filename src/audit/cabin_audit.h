// Parts of the cabin robot's equation audit [Liu 2025].
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analytic/cabin_robot/stiffness.h"
#include "audit/audit.h"
#include "core/types.h"
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
// unless a test bends one of them.

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
[[nodiscard]] std::vector<AuditRow> StiffnessRows(const std::string& models_dir,
                                                  const cabin::StiffnessParameters& parameters);

}  // namespace mbv::cabin_audit
