// The closed form of the cabin robot for the comparison.
#pragma once

#include <memory>

#include "analytic/closed_form.h"

namespace mbv {

/// Makes the closed form. Motions accepted (every command with one term):
///   * task space: d1, platform.x, platform.y, platform.yaw, th3, th4, d5, th6 (inverse problem);
///   * joint space: the eight drives d1, X1, X2, X3, th3, th4, d5, th6 (forward problem);
///   * end-effector space: tool.x … tool.yaw with platform.yaw and either d1 (rail given) or
///     platform.y (height given), which resolve the two redundant freedoms.
[[nodiscard]] std::unique_ptr<ClosedForm> MakeCabinRobot(const Mechanism& mechanism,
                                                         const Motion& motion,
                                                         const ClosedFormOptions& options,
                                                         Diagnostics* diagnostics);

}  // namespace mbv
