// Generic constraint rows of a Mechanism in maximal coordinates (one pose per body).
//
// With V the twists and A the accelerations of body_states.h, a row's residual r is differentiated
// as  ṙ = J V  and  r̈ = J A + b.
#pragma once

#include "core/types.h"
#include "mechanism/body_states.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

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

/// J V: the coordinate's rate where `twists` are the bodies' velocities, without b its acceleration
/// where they are their accelerations.
[[nodiscard]] inline double RateOf(const ScalarRow& row, const std::vector<Vec6>& twists) {
  return row.J_parent.dot(twists[static_cast<size_t>(row.parent)]) +
         row.J_child.dot(twists[static_cast<size_t>(row.child)]);
}

/// A coordinate of a joint; angles are returned within ±π of `near_value`.
[[nodiscard]] ScalarRow JointCoordinateRow(const Joint& joint, int coordinate,
                                           const BodyStates& states, double near_value = 0.0);
[[nodiscard]] ScalarRow DriveRow(const Mechanism& mechanism, const Drive& drive,
                                 const BodyStates& states, double near_value = 0.0);
/// Component 0…5 (x, y, z, roll, pitch, yaw) of an output.
[[nodiscard]] ScalarRow OutputRow(const Output& output, int component, const BodyStates& states,
                                  double near_value = 0.0);
/// Coordinate 0…5 of a bushing (Bushing).
[[nodiscard]] ScalarRow BushingRow(const Bushing& bushing, int coordinate,
                                   const BodyStates& states);
[[nodiscard]] ScalarRow CoordinateRow(const Mechanism& mechanism, const Coordinate& coordinate,
                                      const BodyStates& states, double near_value = 0.0);

}  // namespace mbv
