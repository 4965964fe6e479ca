#include "mechanism/joint_pose.h"

#include <cmath>

#include "core/demand.h"
#include "core/spatial.h"
#include "mechanism/joint_coordinate.h"

namespace mbv {

Mat3 JointBasis(const Joint& joint) {
  const Vec3& a = joint.axis;
  Mat3 E;
  E.col(2) = a;
  if (a == Vec3::UnitZ()) {
    E.col(0) = Vec3::UnitX();
  } else if (a == Vec3::UnitX()) {
    E.col(0) = Vec3::UnitY();
  } else if (a == Vec3::UnitY()) {
    E.col(0) = Vec3::UnitZ();
  } else {
    E.col(0) = a.unitOrthogonal();
  }
  E.col(1) = a.cross(E.col(0));
  return E;
}

Pose JointPose(const Joint& joint, const std::array<double, 6>& q) {
  Pose X_FM = Pose::Identity();
  const auto turn = [](const Vec3& axis, double angle) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };
  switch (joint.kind) {
    case JointKind::kFixed:
      break;
    case JointKind::kRevolute:
      X_FM.linear() = turn(joint.axis, q[0]);
      break;
    case JointKind::kPrismatic:
      X_FM.translation() = q[0] * joint.axis;
      break;
    case JointKind::kCylindrical:
      X_FM.translation() = q[0] * joint.axis;
      X_FM.linear() = turn(joint.axis, q[1]);
      break;
    case JointKind::kUniversal:
      X_FM.linear() = turn(joint.axis, q[0]) * turn(joint.axis2, q[1]);
      break;
    case JointKind::kSpherical:
      X_FM.linear() = RotRpy({q[0], q[1], q[2]});
      break;
    case JointKind::kPlanar: {
      const Mat3 E = JointBasis(joint);
      X_FM.translation() = q[0] * E.col(0) + q[1] * E.col(1);
      X_FM.linear() = turn(joint.axis, q[2]);
      break;
    }
    case JointKind::kFree:
      X_FM.translation() = Vec3(q[0], q[1], q[2]);
      X_FM.linear() = RotRpy({q[3], q[4], q[5]});
      break;
  }
  return X_FM;
}

std::array<double, 6> CoordinatesOf(const Joint& joint, const Pose& X_FM) {
  std::array<double, 6> q{};
  for (int c = 0; c < FreedomsOf(joint.kind); ++c) {
    q[c] = internal::CoordinateBetween(joint, c, internal::RestingPair{X_FM});
  }
  return q;
}

double RotationGap(const Joint& joint, const Pose& X_FM) {
  if (FreedomsOf(joint.kind) == 6 || joint.kind == JointKind::kSpherical) return 0.0;
  const Pose X_nearest = JointPose(joint, CoordinatesOf(joint, X_FM));
  return LogRotation(X_nearest.linear().transpose() * X_FM.linear()).norm();
}

std::vector<Pose> TreePoses(const Mechanism& mechanism,
                            const std::vector<std::array<double, 6>>& q) {
  std::vector<Pose> X_FM(mechanism.joints.size(), Pose::Identity());
  for (const int j : mechanism.tree_joints) X_FM[j] = JointPose(mechanism.joints[j], q[j]);
  return ChainPoses(mechanism, X_FM);
}

std::vector<Pose> ChainPoses(const Mechanism& mechanism, const std::vector<Pose>& X_FM) {
  MBV_DEMAND(mechanism.tree_joints.size() == mechanism.tree_reversed.size(), mechanism.name);
  std::vector<Pose> X_WB(mechanism.bodies.size(), Pose::Identity());
  for (size_t i = 0; i < mechanism.tree_joints.size(); ++i) {
    const int j = mechanism.tree_joints[i];
    const Joint& joint = mechanism.joints[j];
    if (mechanism.tree_reversed[i]) {
      X_WB[joint.parent] =
          X_WB[joint.child] * joint.X_CM * X_FM[j].inverse() * joint.X_PF.inverse();
    } else {
      X_WB[joint.child] = X_WB[joint.parent] * joint.X_PF * X_FM[j] * joint.X_CM.inverse();
    }
  }
  return X_WB;
}

}  // namespace mbv
