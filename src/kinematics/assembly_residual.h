// Residual of closures for the search of assemblies. Internal to kinematics/.
#pragma once

#include "mechanism/mechanism.h"

namespace mbv::internal {

/// What is left open at a closure, and its derivative by the twists of its two bodies. Lengths are
/// relative to `length`.
struct ClosureGap {
  VecX residual;
  MatX J_parent, J_child;  ///< rows × 6
};
struct ClosureFrames {
  Pose X_WP, X_WC;  ///< of parent and child body
};
[[nodiscard]] ClosureGap AssemblyResidual(const Joint& joint, const ClosureFrames& frames,
                                          double length);

}  // namespace mbv::internal
