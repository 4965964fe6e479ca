#include "mechanism/joint_pose.h"

#include <cmath>

#include "base/demand.h"
#include "math/spatial.h"

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
    case JointKind::kPointOnLine:
      X_FM.translation() = q[0] * joint.axis;
      X_FM.linear() = RotRpy({q[1], q[2], q[3]});
      break;
    case JointKind::kPointOnPlane:
      X_FM.translation() = JointBasis(joint).leftCols<2>() * Eigen::Vector2d(q[0], q[1]);
      X_FM.linear() = RotRpy({q[2], q[3], q[4]});
      break;
    case JointKind::kFree:
      X_FM.translation() = Vec3(q[0], q[1], q[2]);
      X_FM.linear() = RotRpy({q[3], q[4], q[5]});
      break;
  }
  return X_FM;
}

std::array<double, 6> CoordinatesOf(const Joint& joint, const Pose& X_FM) {
  std::array<double, 6> q{};
  for (int c = 0; c < DofsOf(joint.kind); ++c) {
    q[c] = internal::CoordinateBetween(joint, c, internal::RestingPair{X_FM});
  }
  return q;
}

double RotationGap(const Joint& joint, const Pose& X_FM) {
  if (HasBall(joint.kind)) return 0.0;
  const Pose X_nearest = JointPose(joint, CoordinatesOf(joint, X_FM));
  return LogRotation(X_nearest.linear().transpose() * X_FM.linear()).norm();
}

JointTwists UnitTwists(const Joint& joint, const Mat3& R_WF, const Mat3& R_WM) {
  JointTwists S = JointTwists::Zero(6, DofsOf(joint.kind));
  const Vec3 axis = R_WF * joint.axis;
  switch (joint.kind) {
    case JointKind::kFixed:
      break;
    case JointKind::kRevolute:
      S.col(0).head<3>() = axis;
      break;
    case JointKind::kPrismatic:
      S.col(0).tail<3>() = axis;
      break;
    case JointKind::kCylindrical:
      S.col(0).tail<3>() = axis;
      S.col(1).head<3>() = axis;
      break;
    case JointKind::kUniversal:
      S.col(0).head<3>() = axis;
      S.col(1).head<3>() = R_WM * joint.axis2;
      break;
    case JointKind::kSpherical:
      S.topRows<3>() = R_WM;
      break;
    case JointKind::kPlanar:
      S.bottomLeftCorner<3, 2>() = R_WF * JointBasis(joint).leftCols<2>();
      S.col(2).head<3>() = axis;
      break;
    case JointKind::kPointOnLine:
      S.col(0).tail<3>() = axis;
      S.topRightCorner<3, 3>() = R_WM;
      break;
    case JointKind::kPointOnPlane:
      S.bottomLeftCorner<3, 2>() = R_WF * JointBasis(joint).leftCols<2>();
      S.topRightCorner<3, 3>() = R_WM;
      break;
    case JointKind::kFree:
      S.bottomLeftCorner<3, 3>() = R_WF;
      S.topRightCorner<3, 3>() = R_WM;
      break;
  }
  return S;
}

void StepJoint(const Joint& joint, const double* dq, Pose* X_FM) {
  const auto turn = [](const Vec3& axis, double angle) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };
  Mat3 R = X_FM->linear();
  Vec3 p = X_FM->translation();
  switch (joint.kind) {
    case JointKind::kFixed:
      break;
    case JointKind::kRevolute:
      R = R * turn(joint.axis, dq[0]);
      break;
    case JointKind::kPrismatic:
      p += dq[0] * joint.axis;
      break;
    case JointKind::kCylindrical:
      p += dq[0] * joint.axis;
      R = R * turn(joint.axis, dq[1]);
      break;
    case JointKind::kUniversal:
      R = turn(joint.axis, dq[0]) * R * turn(joint.axis2, dq[1]);
      break;
    case JointKind::kSpherical:
      R = R * ExpRotation({dq[0], dq[1], dq[2]});
      break;
    case JointKind::kPlanar:
      p += JointBasis(joint).leftCols<2>() * Eigen::Vector2d(dq[0], dq[1]);
      R = R * turn(joint.axis, dq[2]);
      break;
    case JointKind::kPointOnLine:
      p += dq[0] * joint.axis;
      R = R * ExpRotation({dq[1], dq[2], dq[3]});
      break;
    case JointKind::kPointOnPlane:
      p += JointBasis(joint).leftCols<2>() * Eigen::Vector2d(dq[0], dq[1]);
      R = R * ExpRotation({dq[2], dq[3], dq[4]});
      break;
    case JointKind::kFree:
      p += Vec3(dq[0], dq[1], dq[2]);
      R = R * ExpRotation({dq[3], dq[4], dq[5]});
      break;
  }
  X_FM->linear() = R;
  X_FM->translation() = p;
}

int LockedDirections(const Joint& joint, Mat3* directions) {
  switch (joint.kind) {
    case JointKind::kFixed:
    case JointKind::kRevolute:
    case JointKind::kUniversal:
    case JointKind::kSpherical:
      *directions = Mat3::Identity();
      return 3;
    case JointKind::kPrismatic:
    case JointKind::kCylindrical:
    case JointKind::kPointOnLine:
      *directions = JointBasis(joint);
      return 2;
    case JointKind::kPlanar:
    case JointKind::kPointOnPlane:
      directions->col(0) = joint.axis;
      return 1;
    case JointKind::kFree:
      return 0;
  }
  return 0;
}

int LockedCosines(const Joint& joint, std::array<LockedCosine, 3>* cosines) {
  const Mat3 E = JointBasis(joint);
  const auto perpendicular = [&](int f, int m) {
    return LockedCosine{.f_F = E.col(f), .m_M = E.col(m), .value = 0.0};
  };
  switch (joint.kind) {
    case JointKind::kSpherical:
    case JointKind::kPointOnLine:
    case JointKind::kPointOnPlane:
    case JointKind::kFree:
      return 0;
    case JointKind::kUniversal:
      (*cosines)[0] = {.f_F = joint.axis, .m_M = joint.axis2, .value = joint.axis.dot(joint.axis2)};
      return 1;
    case JointKind::kRevolute:
    case JointKind::kCylindrical:
    case JointKind::kPlanar:
      *cosines = {perpendicular(0, 2), perpendicular(1, 2), {}};
      return 2;
    case JointKind::kFixed:
    case JointKind::kPrismatic:
      *cosines = {perpendicular(0, 2), perpendicular(1, 2), perpendicular(1, 0)};
      return 3;
  }
  return 0;
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

namespace mbv::internal {

double RollPitchYaw(const RestingPair& pair, int component) {
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  if (component == 0) return Angle(Cosine(pair, z, y), Cosine(pair, z, z));
  if (component == 2) return Angle(Cosine(pair, y, x), Cosine(pair, x, x));
  return std::atan2(-Cosine(pair, z, x), std::hypot(Cosine(pair, z, y), Cosine(pair, z, z)));
}

}  // namespace mbv::internal
