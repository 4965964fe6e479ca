// The motion that a joint allows: from its coordinates to the pose of M in F, and back.
#pragma once

#include <array>
#include <vector>

#include "core/types.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Columns e1, e2, axis: the right-handed basis in F that planar joints use (see mechanism.h).
[[nodiscard]] Mat3 JointBasis(const Joint& joint);

/// X_FM for given joint coordinates.
[[nodiscard]] Pose JointPose(const Joint& joint, const std::array<double, 6>& coordinates);
/// Joint coordinates of X_FM (the inverse of JointPose on the joint's own motions; spherical and
/// free rotations as roll, pitch, yaw).
[[nodiscard]] std::array<double, 6> CoordinatesOf(const Joint& joint, const Pose& X_FM);

/// Rotation [rad] by which X_FM leaves the joint's own motions, in [0, π]. Unlike the direction
/// cosines of a constraint's rows it does not vanish when an axis points backwards.
[[nodiscard]] double RotationGap(const Joint& joint, const Pose& X_FM);

/// Unit twists [ω; v of Mo] of M in F, one column per freedom.
using JointTwists = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
/// In world axes. Balls and free joints turn about M's own axes.
[[nodiscard]] JointTwists UnitTwists(const Joint& joint, const Mat3& R_WF, const Mat3& R_WM);
/// Moves a joint by small steps `dq` of the freedoms that UnitTwists() has columns for.
void StepJoint(const Joint& joint, const double* dq, Pose* X_FM);

/// The first columns (their number is returned) are the directions in F along which the joint
/// allows no translation.
[[nodiscard]] int LockedDirections(const Joint& joint, Mat3* directions);
/// A direction f of F and m of M whose f·m the joint keeps.
struct LockedCosine {
  Vec3 f_F = Vec3::Zero(), m_M = Vec3::Zero();
  double value = 0.0;
};
/// The first entries (their number is returned) are what locks the joint's rotation.
[[nodiscard]] int LockedCosines(const Joint& joint, std::array<LockedCosine, 3>* cosines);

/// Body poses of the spanning tree for joint coordinates `q[joint]` (entries of closures unused).
[[nodiscard]] std::vector<Pose> TreePoses(const Mechanism& mechanism,
                                          const std::vector<std::array<double, 6>>& q);
/// The same for X_FM of every tree joint, by joint index.
[[nodiscard]] std::vector<Pose> ChainPoses(const Mechanism& mechanism,
                                           const std::vector<Pose>& X_FM);

}  // namespace mbv
