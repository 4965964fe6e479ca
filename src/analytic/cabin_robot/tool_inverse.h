// The complete inverse problem of the cabin robot: drives from the pose of the end effector.
//
// Eight drives, six task freedoms: the rail and the sliders share a direction, and the platform's
// tilt γ can be exchanged against the wrist. The redundancy is resolved by two more commands, kept
// exactly: γ and either the rail position d1 or the platform height Y.
//
// Positions in closed form (not in the paper): with R26 = Rz(γ)ᵀ R = [n o a],
//   th4 = asin(−a_y), th3 = atan2(−a_z, a_x), th6 = atan2(n_y, o_y),
//   p = K + b + d5 y4 with b = Rz(γ)(a2, d3, 0) + a3 x3 + (a4 + d6) R e_z,
// whose rows give d5, X and the free one of Y, d1; then the planar inverse (4). Rates from the
// corrected 6×8 Jacobian (33), (34) with the two resolution rows added.
#pragma once

#include "analytic/cabin_robot/cabin_dynamics.h"

namespace mbv::cabin {

enum class Resolution {
  kRailGiven,    ///< γ and d1 commanded
  kHeightGiven,  ///< γ and Y commanded
};

/// Commanded pose of {6} in the world: position and roll, pitch, yaw of R = Rz Ry Rx, each with two
/// derivatives, and the two resolution coordinates.
struct ToolCommand {
  std::array<Motion1, 3> position;
  std::array<Motion1, 3> rpy;
  Motion1 gamma;
  Motion1 resolved;  ///< d1 or Y
};

/// Fills `planar` and `outer` with positions and both derivatives. kUnreachable as SolveInverse();
/// kSingular where the resolution does not determine the pose (y4 across the resolving direction,
/// the 8×8 Jacobian rank-deficient, or pitch at ±90°).
[[nodiscard]] RunSummary SolveToolPose(const CabinGeometry& geometry, Resolution resolution,
                                       const ToolCommand& command, PlanarState* planar,
                                       OuterDrives* outer);

}  // namespace mbv::cabin
