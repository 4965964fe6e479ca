// The paper's 30 equilibrium equations of a limb, as printed and corrected [Li 2018, section 3].
//
// A second route to the forces that limb_dynamics.h gives in closed form; used by the audit and
// the tests.
//
//   bodies (6 equations each, moments, then forces, in {A_i}; moments about B, E, E', U, U'):
//       cross (at B, massless), link 2, link 2', link 1, link 1'
//   unknowns, each the action on the outer body at the joint's centre:
//       cross → 2  F, M_Y, M_Z      cross → 2' F, M_Y, M_Z      1 → 2  F, M_Y, M_Z
//       1' → 2'    F, M_Y, M_Z      base → 1   F, M_Z           base → 1'  F, M_Z
//       drive, drive'                                           sum 30
//
// As printed the matrix has rank 28: the loop of links carries equal and opposite M_Z, and an X
// force with its moments, without any equation noticing; in exchange nothing holds the limb's tilt
// about Y and the cross' spin about X. Corrected: R22' is a ball on the primed side (its M_Y, M_Z
// are dropped) and the platform acts on the cross along X (f_X) and about X (τ_X, which is 0).
#pragma once

#include "analytic/stabilizing_platform/limb_dynamics.h"

namespace mbv::stabilizing_platform {

struct LimbSystem {
  Eigen::Matrix<double, 30, 30> matrix;
  Eigen::Matrix<double, 30, 1> right_side;
};

enum class LimbSystemForm { kPrinted, kCorrected };

/// The system for given limb forces f_Y, f_Z on the platform [N].
[[nodiscard]] LimbSystem MakeLimbSystem(LimbSystemForm form, const LimbGeometry& geometry,
                                        const LinkWrenches& required, double f_Y, double f_Z);

/// Solution of the corrected system.
struct LimbSystemSolution {
  LimbForces forces;  ///< P_s and drives; on_platform with f_X as solved
  LimbReactions reactions;
  double tau_X = kNan;  ///< platform on cross about X [N m]
};
[[nodiscard]] LimbSystemSolution SolveLimbSystem(const LimbSystem& corrected, double f_Y,
                                                 double f_Z);

/// Singular values of the matrix with its columns scaled to unit length, largest first.
[[nodiscard]] Eigen::Matrix<double, 30, 1> ColumnScaledSingularValues(const LimbSystem& system);

}  // namespace mbv::stabilizing_platform
