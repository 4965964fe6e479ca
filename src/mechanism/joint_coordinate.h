// The coordinates of a joint kind as formulas over two frames. Internal to mechanism/ and
// kinematics/.
//
// One formula serves values and derivatives: `Pair` is what stands for frames F and M. For a Pair
// there are, found by its namespace, Along(pair, n_F) = n·d, Cosine(pair, f_F, m_M) = f·m and
// RollPitchYaw(pair, component), which give a scalar, and Angle(s, c) = atan2(s, c) of two scalars.
// RestingPair gives plain numbers; kinematics/frame_pair.h also gives Jacobians and biases.
#pragma once

#include <cmath>

#include "core/demand.h"
#include "core/types.h"
#include "mechanism/joint_pose.h"
#include "mechanism/mechanism.h"

namespace mbv::internal {

/// F and M at rest; numbers instead of scalars with derivatives.
struct RestingPair {
  const Pose& X_FM;
};
[[nodiscard]] inline double Along(const RestingPair& pair, const Vec3& n_F) {
  return n_F.dot(pair.X_FM.translation());
}
[[nodiscard]] inline double Cosine(const RestingPair& pair, const Vec3& f_F, const Vec3& m_M) {
  return f_F.dot(pair.X_FM.linear() * m_M);
}
[[nodiscard]] inline double Angle(double s, double c) { return std::atan2(s, c); }
/// Roll, pitch or yaw (0, 1, 2) of R_FM = Rz Ry Rx.
[[nodiscard]] double RollPitchYaw(const RestingPair& pair, int component);

/// Angle of M's e1 against F's, about the joint axis.
template <typename Pair>
[[nodiscard]] auto AngleAboutAxis(const Joint& joint, const Pair& pair) {
  const Mat3 E = JointBasis(joint);
  return Angle(Cosine(pair, E.col(1), E.col(0)), Cosine(pair, E.col(0), E.col(0)));
}

/// θ1: turn of axis2 about axis, seen in F; θ2: turn of axis about −axis2, seen in M.
template <typename Pair>
[[nodiscard]] auto UniversalAngle(const Joint& joint, int coordinate, const Pair& pair) {
  const Vec3& a = joint.axis;
  const Vec3& b = joint.axis2;
  if (coordinate == 0) {
    const Vec3 e1 = (b - a.dot(b) * a).normalized();
    return Angle(Cosine(pair, a.cross(e1), b), Cosine(pair, e1, b));
  }
  const Vec3 g1 = (a - a.dot(b) * b).normalized();
  return Angle(Cosine(pair, a, -b.cross(g1)), Cosine(pair, a, g1));
}

/// Coordinate of a joint between F and M.
template <typename Pair>
[[nodiscard]] auto CoordinateBetween(const Joint& joint, int coordinate, const Pair& pair) {
  MBV_DEMAND(coordinate >= 0 && coordinate < FreedomsOf(joint.kind), joint.name);
  switch (joint.kind) {
    case JointKind::kFixed:
      break;
    case JointKind::kRevolute:
      return AngleAboutAxis(joint, pair);
    case JointKind::kPrismatic:
      return Along(pair, joint.axis);
    case JointKind::kCylindrical:
      return coordinate == 0 ? Along(pair, joint.axis) : AngleAboutAxis(joint, pair);
    case JointKind::kUniversal:
      return UniversalAngle(joint, coordinate, pair);
    case JointKind::kSpherical:
      return RollPitchYaw(pair, coordinate);
    case JointKind::kPlanar:
      return coordinate < 2 ? Along(pair, JointBasis(joint).col(coordinate))
                            : AngleAboutAxis(joint, pair);
    case JointKind::kPointOnLine:
      return coordinate < 1 ? Along(pair, joint.axis) : RollPitchYaw(pair, coordinate - 1);
    case JointKind::kPointOnPlane:
      return coordinate < 2 ? Along(pair, JointBasis(joint).col(coordinate))
                            : RollPitchYaw(pair, coordinate - 2);
    case JointKind::kFree:
      return coordinate < 3 ? Along(pair, Vec3::Unit(coordinate))
                            : RollPitchYaw(pair, coordinate - 3);
  }
  ThrowDemand("joint has this coordinate", __FILE__, __LINE__, joint.name);
}

}  // namespace mbv::internal
