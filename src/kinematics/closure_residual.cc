#include "kinematics/closure_residual.h"

#include <Eigen/QR>
#include <cmath>

#include "kinematics/constraints.h"

namespace mbv::internal {

VecX ClosureResidual(const Mechanism& mechanism, const TreeMotion& tree, const BodyStates& states,
                     double length, MatX* J) {
  std::vector<ConstraintRows> all;
  int count = 0;
  for (const Joint& joint : mechanism.joints) {
    if (!joint.closure) continue;
    all.push_back(RowsOf(joint, states, false));
    count += all.back().rows;
  }
  const std::vector<CouplingRow> coupled = CouplingRows(mechanism, states);
  VecX r(count + static_cast<Eigen::Index>(coupled.size()));
  MatX J_bodies;
  if (J != nullptr) {
    J->setZero(r.size(), tree.dofs());
    J_bodies = tree.Jacobian(states);
  }
  int at = 0;
  for (const ConstraintRows& rows : all) {
    VecX scale = VecX::Ones(rows.rows);
    scale.head(rows.translation_rows).setConstant(1.0 / length);
    r.segment(at, rows.rows) = scale.cwiseProduct(rows.residual.head(rows.rows));
    if (J != nullptr) {
      J->middleRows(at, rows.rows) =
          scale.asDiagonal() *
          (rows.J_parent.topRows(rows.rows) * J_bodies.middleRows<6>(6 * rows.parent) +
           rows.J_child.topRows(rows.rows) * J_bodies.middleRows<6>(6 * rows.child));
    }
    at += rows.rows;
  }
  for (const CouplingRow& row : coupled) {
    const double scale = row.angular ? 1.0 : 1.0 / length;
    r[at] = scale * row.value;
    for (size_t k = 0; J != nullptr && k < row.pieces.size(); ++k) {
      const ScalarRow& piece = row.pieces[k];
      J->row(at) += scale * (piece.J_parent.transpose() * J_bodies.middleRows<6>(6 * piece.parent) +
                             piece.J_child.transpose() * J_bodies.middleRows<6>(6 * piece.child));
    }
    ++at;
  }
  return r;
}

VecX DampedStep(const MatX& J, const VecX& r, double mu) {
  MatX stacked(J.rows() + J.cols(), J.cols());
  stacked << J, std::sqrt(mu) * MatX::Identity(J.cols(), J.cols());
  VecX right = VecX::Zero(stacked.rows());
  right.head(r.size()) = -r;
  return stacked.householderQr().solve(right);
}

}  // namespace mbv::internal
