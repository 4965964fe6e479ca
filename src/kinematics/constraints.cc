#include "kinematics/constraints.h"

#include <array>
#include <cmath>
#include <numbers>

#include "core/demand.h"
#include "kinematics/frame_pair.h"
#include "mechanism/joint_pose.h"

namespace mbv {
namespace {

using internal::Along;
using internal::Cosine;
using internal::FramePair;
using internal::MakePair;
using internal::PairScalar;

// Collects scalars as rows; `offset` is what the scalar should be.
class RowWriter {
 public:
  explicit RowWriter(ConstraintRows* rows) : rows_(*rows) {}

  void Add(const PairScalar& scalar, double offset = 0.0) {
    const int i = rows_.rows++;
    rows_.residual[i] = scalar.value - offset;
    rows_.J_parent.row(i) = scalar.J_parent.transpose();
    rows_.J_child.row(i) = scalar.J_child.transpose();
    rows_.bias[i] = scalar.bias;
  }
  void Translation(const PairScalar& scalar) {
    Add(scalar);
    ++rows_.translation_rows;
  }

 private:
  ConstraintRows& rows_;
};

ScalarRow ToRow(const PairScalar& scalar, int parent, int child) {
  return {.parent = parent,
          .child = child,
          .value = scalar.value,
          .J_parent = scalar.J_parent,
          .J_child = scalar.J_child,
          .bias = scalar.bias};
}

void TurnNear(double near_value, double* angle) {
  constexpr double kTurn = 2 * std::numbers::pi;
  *angle += kTurn * std::round((near_value - *angle) / kTurn);
}

Pose At(const Vec3& point) { return Pose(Eigen::Translation3d(point)); }

}  // namespace

ConstraintRows RowsOf(const Joint& joint, const BodyStates& states, bool reactions) {
  const FramePair pair = MakePair(states, joint.parent, joint.X_PF, joint.child, joint.X_CM);
  ConstraintRows rows;
  rows.parent = joint.parent;
  rows.child = joint.child;
  RowWriter out(&rows);
  Mat3 directions;
  const int locked = LockedDirections(joint, &directions);
  for (int i = 0; i < locked; ++i) out.Translation(Along(pair, directions.col(i)));
  if (reactions && joint.transmits_force_only) return rows;
  std::array<LockedCosine, 3> cosines;
  const int turns = LockedCosines(joint, &cosines);
  for (int i = 0; i < turns; ++i)
    out.Add(Cosine(pair, cosines[i].f_F, cosines[i].m_M), cosines[i].value);
  return rows;
}

ScalarRow JointCoordinateRow(const Joint& joint, int coordinate, const BodyStates& states,
                             double near_value) {
  const FramePair pair = MakePair(states, joint.parent, joint.X_PF, joint.child, joint.X_CM);
  ScalarRow row =
      ToRow(internal::JointCoordinate(joint, coordinate, pair), joint.parent, joint.child);
  if (!IsLength(joint.kind, coordinate)) TurnNear(near_value, &row.value);
  return row;
}

ScalarRow DriveRow(const Mechanism& mechanism, const Drive& drive, const BodyStates& states,
                   double near_value) {
  if (const auto* on_joint = std::get_if<JointDrive>(&drive.kind)) {
    return JointCoordinateRow(mechanism.joints[on_joint->joint], on_joint->coordinate, states,
                              near_value);
  }
  const auto& leg = std::get<DistanceDrive>(drive.kind);
  const FramePair pair = MakePair(states, leg.body_from, At(leg.p_from), leg.body_to, At(leg.p_to));
  return ToRow(internal::Distance(pair), leg.body_from, leg.body_to);
}

ScalarRow OutputRow(const Output& output, int component, const BodyStates& states,
                    double near_value) {
  const FramePair pair =
      MakePair(states, output.reference_body, output.X_RbR, output.body, output.X_BO);
  MBV_DEMAND(component >= 0 && component < 6, component);
  if (component < 3) {
    return ToRow(Along(pair, Vec3::Unit(component)), output.reference_body, output.body);
  }
  ScalarRow row =
      ToRow(internal::RollPitchYaw(pair, component - 3), output.reference_body, output.body);
  TurnNear(near_value, &row.value);
  return row;
}

ScalarRow BushingRow(const Bushing& bushing, int coordinate, const BodyStates& states) {
  const FramePair pair =
      MakePair(states, bushing.parent, bushing.X_PF, bushing.child, bushing.X_CM);
  MBV_DEMAND(coordinate >= 0 && coordinate < 6, coordinate);
  return ToRow(coordinate < 3 ? Along(pair, Vec3::Unit(coordinate))
                              : internal::RotationVector(pair, coordinate - 3),
               bushing.parent, bushing.child);
}

ScalarRow CoordinateRow(const Mechanism& mechanism, const Coordinate& coordinate,
                        const BodyStates& states, double near_value) {
  switch (coordinate.kind) {
    case Coordinate::Kind::kPrescribed:
      return JointCoordinateRow(mechanism.joints[mechanism.prescribed[coordinate.index].joint], 0,
                                states, near_value);
    case Coordinate::Kind::kDrive:
      return DriveRow(mechanism, mechanism.drives[coordinate.index], states, near_value);
    case Coordinate::Kind::kOutput:
      return OutputRow(mechanism.outputs[coordinate.index], coordinate.component, states,
                       near_value);
    case Coordinate::Kind::kJoint:
      return JointCoordinateRow(mechanism.joints[coordinate.index], coordinate.component, states,
                                near_value);
  }
  ThrowDemand("known coordinate kind", __FILE__, __LINE__, "?");
}

}  // namespace mbv
