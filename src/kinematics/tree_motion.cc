#include "kinematics/tree_motion.h"

#include "kinematics/constraints.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"

namespace mbv::internal {

TreeMotion::TreeMotion(const Mechanism& mechanism, const std::vector<bool>& locked)
    : mechanism_(mechanism), first_column_(mechanism.joints.size(), -1) {
  for (const int j : mechanism.tree_joints) {
    if (locked[j]) continue;
    const JointKind kind = mechanism.joints[j].kind;
    first_column_[j] = dofs_;
    for (int c = 0; c < DofsOf(kind); ++c) angular_.push_back(!IsLength(kind, c));
    dofs_ += DofsOf(kind);
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
  MatX J = MatX::Zero(6 * bodies, dofs_);
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

    // … and moves by the joint's own DOFs, backwards when the joint is reversed.
    const Pose X_WM = states.X_WB[joint.child] * joint.X_CM;
    const Mat3 R_WF = states.X_WB[joint.parent].linear() * joint.X_PF.linear();
    JointTwists S = UnitTwists(joint, R_WF, X_WM.linear());
    S.bottomRows<3>() -= Skew(p_out - X_WM.translation()) * S.topRows<3>();
    J_out.middleCols(first_column_[j], S.cols()) += reversed ? JointTwists(-S) : S;
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

namespace mbv {

LoadSample AtStates(const Mechanism& mechanism, const BodyStates& states,
                    const LoadSample& sample) {
  LoadSample at = sample;
  if (sample.load == nullptr) return at;
  std::vector<double> inputs;
  for (const Load::Following& part : sample.load->following) {
    inputs.clear();
    for (const StateFunction::Input& input : part.function.inputs) {
      const ScalarRow row = CoordinateRow(mechanism, input.coordinate, states, input.near);
      inputs.push_back(input.rate ? RateOf(row, states.V_WB) : row.value);
    }
    Vec3& vector = part.component < 3 ? at.force : at.moment;
    vector[part.component % 3] += part.function.value(sample.time_s, inputs);
  }
  return at;
}

}  // namespace mbv
