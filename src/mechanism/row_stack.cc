#include "mechanism/row_stack.h"

#include <Eigen/SVD>

#include "mechanism/frame_pair.h"

namespace mbv::internal {

void RowStack::Add(int parent, const Vec6& J_parent, int child, const Vec6& J_child,
                   bool translation) {
  VecX row = VecX::Zero(columns_);
  const double scale = translation ? 1.0 / length_ : 1.0;
  const auto put = [&](int body, const Vec6& J) {
    if (body == 0) return;
    row.segment<3>(6 * (body - 1)) += scale * J.head<3>();
    row.segment<3>(6 * (body - 1) + 3) += scale * length_ * J.tail<3>();
  };
  put(parent, J_parent);
  put(child, J_child);
  rows_.push_back(row);
}

void RowStack::Add(const ConstraintRows& rows) {
  for (int i = 0; i < rows.rows; ++i) {
    Add(rows.parent, rows.J_parent.row(i), rows.child, rows.J_child.row(i),
        i < rows.translation_rows);
  }
}

void RowStack::AddJoints(const Mechanism& mechanism, const BodyStates& states, bool reactions) {
  for (const Joint& joint : mechanism.joints) Add(RowsOf(joint, states, reactions));
}

void RowStack::AddDriven(const Mechanism& mechanism, const BodyStates& states) {
  for (const Drive& drive : mechanism.drives) {
    Add(DriveRow(mechanism, drive, states), PositionUnit(mechanism, drive) == "m");
  }
  for (const Prescribed& prescribed : mechanism.prescribed) {
    const Joint& joint = mechanism.joints[prescribed.joint];
    Add(JointCoordinateRow(joint, 0, states), !IsAngle(joint.kind, 0));
  }
}

MatX RowStack::Matrix() const {
  MatX J(size(), columns_);
  for (int i = 0; i < size(); ++i) J.row(i) = rows_[i].transpose();
  return J;
}

RankFinding FindRank(const MatX& J, NullSpaces wanted) {
  RankFinding out;
  if (J.rows() == 0 || J.cols() == 0) {
    if (wanted == NullSpaces::kSelfStress) out.self_stress = MatX::Identity(J.rows(), J.rows());
    if (wanted == NullSpaces::kMotion) out.motion = MatX::Identity(J.cols(), J.cols());
    return out;
  }
  const unsigned options = wanted == NullSpaces::kSelfStress ? Eigen::ComputeFullU
                           : wanted == NullSpaces::kMotion   ? Eigen::ComputeFullV
                                                             : 0;
  const Eigen::BDCSVD<MatX> svd(J, options);
  const VecX& s = svd.singularValues();
  while (out.rank < s.size() && s[out.rank] > kRankTolerance * s[0]) ++out.rank;
  if (out.rank > 0) out.smallest_kept = s[out.rank - 1];
  if (out.rank < s.size()) out.largest_dropped = s[out.rank];
  if (wanted == NullSpaces::kSelfStress) {
    out.self_stress = svd.matrixU().rightCols(J.rows() - out.rank);
  }
  if (wanted == NullSpaces::kMotion) out.motion = svd.matrixV().rightCols(J.cols() - out.rank);
  return out;
}

}  // namespace mbv::internal
