#include "kinematics/tree_motion.h"

#include "core/spatial.h"
#include "mechanism/joint_coordinate.h"
#include "mechanism/joint_pose.h"

namespace mbv::internal {
namespace {

using Freedoms = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, 6>;

// Unit twists [ω; v of Mo] of M in F, world axes, one column per freedom. Balls and free joints
// turn about M's own axes.
Freedoms UnitTwists(const Joint& joint, const Mat3& R_WF, const Mat3& R_WM) {
  Freedoms S = Freedoms::Zero(6, FreedomsOf(joint.kind));
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
    case JointKind::kFree:
      p += Vec3(dq[0], dq[1], dq[2]);
      R = R * ExpRotation({dq[3], dq[4], dq[5]});
      break;
  }
  X_FM->linear() = R;
  X_FM->translation() = p;
}

}  // namespace

TreeMotion::TreeMotion(const Mechanism& mechanism, const std::vector<bool>& locked)
    : mechanism_(mechanism), first_column_(mechanism.joints.size(), -1) {
  for (const int j : mechanism.tree_joints) {
    if (locked[j]) continue;
    const JointKind kind = mechanism.joints[j].kind;
    first_column_[j] = freedoms_;
    for (int c = 0; c < FreedomsOf(kind); ++c) angular_.push_back(IsAngle(kind, c));
    freedoms_ += FreedomsOf(kind);
  }
}

BodyStates TreeMotion::States(const std::vector<Pose>& X_FM) const {
  BodyStates states;
  states.Resize(mechanism_.bodies.size());
  states.X_WB = ChainPoses(mechanism_, X_FM);
  return states;
}

MatX TreeMotion::Jacobian(const BodyStates& states) const {
  const auto bodies = static_cast<Eigen::Index>(mechanism_.bodies.size());
  MatX J = MatX::Zero(6 * bodies, freedoms_);
  for (size_t i = 0; i < mechanism_.tree_joints.size(); ++i) {
    const int j = mechanism_.tree_joints[i];
    const Joint& joint = mechanism_.joints[j];
    const bool reversed = mechanism_.tree_reversed[i];
    const int in = reversed ? joint.child : joint.parent;
    const int out = reversed ? joint.parent : joint.child;

    // The outboard body goes along with the inboard one …
    const Vec3& p_out = states.X_WB[out].translation();
    const Vec3 p_InOut = p_out - states.X_WB[in].translation();
    auto J_out = J.middleRows<6>(6 * out);
    J_out = J.middleRows<6>(6 * in);
    J_out.bottomRows<3>() -= Skew(p_InOut) * J_out.topRows<3>();
    if (first_column_[j] < 0) continue;

    // … and moves by the joint's own freedoms, backwards when the joint is reversed.
    const Pose X_WM = states.X_WB[joint.child] * joint.X_CM;
    const Mat3 R_WF = states.X_WB[joint.parent].linear() * joint.X_PF.linear();
    Freedoms S = UnitTwists(joint, R_WF, X_WM.linear());
    S.bottomRows<3>() -= Skew(p_out - X_WM.translation()) * S.topRows<3>();
    J_out.middleCols(first_column_[j], S.cols()) += reversed ? Freedoms(-S) : S;
  }
  return J;
}

void TreeMotion::Step(const VecX& dq, std::vector<Pose>* X_FM) const {
  for (size_t j = 0; j < first_column_.size(); ++j) {
    if (first_column_[j] < 0) continue;
    StepJoint(mechanism_.joints[j], dq.data() + first_column_[j], &(*X_FM)[j]);
  }
}

}  // namespace mbv::internal
