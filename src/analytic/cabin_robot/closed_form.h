// The closed form of the cabin robot for the comparison.
#pragma once

#include <memory>

#include "analytic/closed_form.h"
#include "analytic/coverage.h"

namespace mbv::cabin_robot {

/// Makes the closed form. Motions accepted (every command with one term):
///   * task space: d1, platform.x, platform.y, platform.yaw, th3, th4, d5, th6 (inverse problem);
///   * joint space: the eight drives d1, X1, X2, X3, th3, th4, d5, th6 (forward problem);
///   * end-effector space: tool.x … tool.yaw with platform.yaw and either d1 (rail given) or
///     platform.y (height given), which resolve the two redundant DOFs.
[[nodiscard]] std::unique_ptr<ClosedForm> MakeClosedForm(const Mechanism& mechanism,
                                                         const Motion& motion,
                                                         const ClosedFormOptions& options,
                                                         Diagnostics* diagnostics);

// What the equations of the cabin robot take for granted.

/// A planar linkage on three sliders, hinges along the rail, and a wrist by the angles of Table 1;
/// principal axes along the body frames.
[[nodiscard]] Coverage CoverageOf(const Mechanism& mechanism);

/// Of the stiffness: both linkages, every link, column, arm, rail and tool a beam of rectangular
/// section, all drives locked.
[[nodiscard]] Coverage StiffnessCoverageOf(const Mechanism& mechanism);

}  // namespace mbv::cabin_robot
