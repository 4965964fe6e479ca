// Generic constraint rows of a Mechanism in maximal coordinates (one pose per body).
//
// The state of a body is its pose X_WB, twist V_WB = [ω; v of Bo] in world axes, and acceleration
// A_WB = [ε; a of Bo] (classical acceleration of the origin, not the spatial one). A row's
// residual r is differentiated as  ṙ = J V  and  r̈ = J A + b.
#pragma once

#include <vector>

#include "core/types.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Pose, twist and acceleration of every body; index 0 (the world) stays at rest.
struct BodyStates {
  std::vector<Pose> X_WB;
  std::vector<Vec6> V_WB;
  std::vector<Vec6> A_WB;

  void Resize(size_t bodies);
};

/// Up to six scalar rows between two bodies.
struct ConstraintRows {
  int rows = 0;
  int translation_rows = 0;  ///< these come first; the rest are rotation rows
  int parent = 0, child = 0;
  Vec6 residual = Vec6::Zero();  ///< first `rows` entries: m for translation rows,
                                 ///< direction cosines (≈ rad) for rotation rows
  Mat6 J_parent = Mat6::Zero();  ///< rows × 6, multiplies V of the parent
  Mat6 J_child = Mat6::Zero();   ///< rows × 6, multiplies V of the child
  Vec6 bias = Vec6::Zero();      ///< b in r̈ = J A + b
};

/// Rows that a joint imposes (6 − freedoms). With `reactions` true, the isostatic rule is applied:
/// a joint that transmits a force only has its three translation rows and no others.
[[nodiscard]] ConstraintRows RowsOf(const Joint& joint, const BodyStates& states, bool reactions);

/// One scalar coordinate with its Jacobian on two bodies: value, ċ = J V, c̈ = J A + b. Multiplying
/// Jᵀ by a drive force gives the wrenches (about the body origins, world axes) of the drive.
struct ScalarRow {
  int parent = 0, child = 0;
  double value = 0.0;
  Vec6 J_parent = Vec6::Zero(), J_child = Vec6::Zero();
  double bias = 0.0;
};

/// A coordinate of a joint; angles are returned within ±π of `near_value`.
[[nodiscard]] ScalarRow JointCoordinateRow(const Joint& joint, int coordinate,
                                           const BodyStates& states, double near_value = 0.0);
[[nodiscard]] ScalarRow DriveRow(const Mechanism& mechanism, const Drive& drive,
                                 const BodyStates& states, double near_value = 0.0);
/// Component 0…5 (x, y, z, roll, pitch, yaw) of an output.
[[nodiscard]] ScalarRow OutputRow(const Output& output, int component, const BodyStates& states,
                                  double near_value = 0.0);
[[nodiscard]] ScalarRow CoordinateRow(const Mechanism& mechanism, const Coordinate& coordinate,
                                      const BodyStates& states, double near_value = 0.0);

/// Columns e1, e2, axis: the right-handed basis in F that planar joints use (see mechanism.h).
[[nodiscard]] Mat3 JointBasis(const Joint& joint);

/// X_FM for given joint coordinates.
[[nodiscard]] Pose JointPose(const Joint& joint, const std::array<double, 6>& coordinates);
/// Joint coordinates of X_FM (the inverse of JointPose on the joint's own motions; spherical and
/// free rotations as roll, pitch, yaw).
[[nodiscard]] std::array<double, 6> CoordinatesOf(const Joint& joint, const Pose& X_FM);

/// Rotation [rad] by which X_FM leaves the joint's own motions, in [0, π]. Unlike the direction
/// cosines of RowsOf it does not vanish when an axis points backwards.
[[nodiscard]] double RotationGap(const Joint& joint, const Pose& X_FM);

/// A length typical of the mechanism [m], to weigh metres against radians: the root mean square
/// distance of two attachments of one body, wherever the bodies' origins lie (reach.h).
[[nodiscard]] double CharacteristicLength(const Mechanism& mechanism);

/// Body poses of the spanning tree for joint coordinates `q[joint]` (entries of closures unused).
[[nodiscard]] std::vector<Pose> TreePoses(const Mechanism& mechanism,
                                          const std::vector<std::array<double, 6>>& q);

}  // namespace mbv
