// The motion that a joint allows: from its coordinates to the pose of M in F, and back.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "base/demand.h"
#include "base/types.h"
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

/// Unit twists [ω; v of Mo] of M in F, one column per DOF.
using JointTwists = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;
/// In world axes. Balls and free joints turn about M's own axes.
[[nodiscard]] JointTwists UnitTwists(const Joint& joint, const Mat3& R_WF, const Mat3& R_WM);
/// Moves a joint by small steps `dq` of the DOFs that UnitTwists() has columns for.
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

// The coordinates of a joint kind as formulas over two frames. Internal to mechanism/ and
// kinematics/.
//
// One formula serves values and derivatives: `Pair` is what stands for frames F and M. For a Pair
// there are, found by its namespace, Along(pair, n_F) = n·d, Cosine(pair, f_F, m_M) = f·m and
// RollPitchYaw(pair, component), which give a scalar, and Angle(s, c) = atan2(s, c) of two scalars.
// RestingPair gives plain numbers; kinematics/frame_pair.h also gives Jacobians and biases.

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
  MBV_DEMAND(coordinate >= 0 && coordinate < DofsOf(joint.kind), joint.name);
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
