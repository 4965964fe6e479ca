#include "kinematics/loop_rows.h"

namespace mbv::internal {

Eigen::RowVectorXd RowAlong(const ScalarRow& row, const MatX& J) {
  return row.J_parent.transpose() * J.middleRows<6>(6 * row.parent) +
         row.J_child.transpose() * J.middleRows<6>(6 * row.child);
}

MatX LoopRows(const Mechanism& mechanism, const std::vector<Spin>& spins, const BodyStates& states,
              const MatX& J, double length) {
  std::vector<Eigen::RowVectorXd> rows;
  for (const Joint& joint : mechanism.joints) {
    if (!joint.closure) continue;
    const ConstraintRows closure = RowsOf(joint, states, false, false);
    for (int i = 0; i < closure.rows; ++i) {
      rows.emplace_back((i < closure.translation_rows ? 1.0 : length) *
                        (closure.J_parent.row(i) * J.middleRows<6>(6 * closure.parent) +
                         closure.J_child.row(i) * J.middleRows<6>(6 * closure.child)));
    }
  }
  for (const CouplingRow& coupling : CouplingRows(mechanism, states)) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(J.cols());
    for (const ScalarRow& piece : coupling.pieces) row += RowAlong(piece, J);
    rows.emplace_back((coupling.angular ? length : 1.0) * row);
  }
  for (const Spin& spin : spins) rows.emplace_back(length * RowAlong(IdleRow(spin, states), J));
  MatX A(static_cast<Eigen::Index>(rows.size()), J.cols());
  for (size_t r = 0; r < rows.size(); ++r) A.row(static_cast<Eigen::Index>(r)) = rows[r];
  return A;
}

}  // namespace mbv::internal
