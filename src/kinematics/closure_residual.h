// Closure rows of a mechanism in the coordinates of its spanning tree. Internal to kinematics/.
#pragma once

#include "kinematics/tree_motion.h"
#include "mechanism/motion.h"

namespace mbv::internal {

/// Residuals of all closure rows, lengths relative to `length`; with their Jacobian (lengths of the
/// coordinates not scaled) when J is given.
[[nodiscard]] VecX ClosureResidual(const Mechanism& mechanism, const TreeMotion& tree,
                                   const BodyStates& states, double length, MatX* J);

/// s that makes |r + J s|² + μ |s|² least, by QR of the stacked matrix [J; √μ 1]: that keeps full
/// accuracy as μ → 0 and tolerates redundant rows and free motions alike.
[[nodiscard]] VecX DampedStep(const MatX& J, const VecX& r, double mu);

}  // namespace mbv::internal
