// The direct stiffness method, for tests: the displacement twin of the force method in reference/.
// Textbook 12 × 12 matrices of Euler–Bernoulli beams [Przemieniecki 1968, eq. 5.116] at the beam
// ends, servos as springs, joints as constraints on the displacements, eliminated by their null
// space; what remains free has no stiffness and is left out. SI units, no scaling.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "kinematics/constraints.h"
#include "math/spatial.h"
#include "mechanism/mechanism.h"

namespace mbv::fixtures {

/// Forces [f_a; m_a; f_b; m_b] per displacements [u_a; θ_a; u_b; θ_b] in beam axes.
inline Eigen::Matrix<double, 12, 12> TextbookBeam(const Beam& beam) {
  const double L = beam.length(), E = beam.youngs_modulus;
  const double a = E * beam.section.area / L, t = beam.shear_modulus * beam.section.torsion / L;
  const double z = E * beam.section.I_z / (L * L * L), y = E * beam.section.I_y / (L * L * L);
  Eigen::Matrix<double, 12, 12> k = Eigen::Matrix<double, 12, 12>::Zero();
  const auto put = [&](int i, int j, double value) { k(i, j) = k(j, i) = value; };
  put(0, 0, a), put(6, 6, a), put(0, 6, -a);
  put(3, 3, t), put(9, 9, t), put(3, 9, -t);
  put(1, 1, 12 * z), put(7, 7, 12 * z), put(1, 7, -12 * z);
  put(1, 5, 6 * z * L), put(1, 11, 6 * z * L), put(5, 7, -6 * z * L), put(7, 11, -6 * z * L);
  put(5, 5, 4 * z * L * L), put(11, 11, 4 * z * L * L), put(5, 11, 2 * z * L * L);
  put(2, 2, 12 * y), put(8, 8, 12 * y), put(2, 8, -12 * y);
  put(2, 4, -6 * y * L), put(2, 10, -6 * y * L), put(4, 8, 6 * y * L), put(8, 10, 6 * y * L);
  put(4, 4, 4 * y * L * L), put(10, 10, 4 * y * L * L), put(4, 10, 2 * y * L * L);
  return k;
}

/// C of an output that is held in all directions.
class DirectStiffness {
 public:
  DirectStiffness(const Mechanism& m, const std::vector<Pose>& X_WB) : m_(m) {
    states_.Resize(X_WB.size());
    states_.X_WB = X_WB;
    for (size_t b = 1; b < m.bodies.size(); ++b) {
      bool elastic = false;
      for (const Beam& beam : m.beams) elastic = elastic || beam.body == static_cast<int>(b);
      if (!elastic) nodes_.push_back({static_cast<int>(b), Vec3::Zero(), false});
    }
    for (const Beam& beam : m.beams) {
      for (const Vec3& end : {beam.p_from, beam.p_to}) {
        if (NodeOf(beam.body, end) < 0) nodes_.push_back({beam.body, end, true});
      }
    }
    K_.setZero(6 * nodes_.size(), 6 * nodes_.size());
    for (const Beam& beam : m.beams) AddBeam(beam);
    for (const Joint& joint : m.joints) {
      const ConstraintRows rows = RowsOf(joint, states_, false);
      for (int i = 0; i < rows.rows; ++i) {
        constraints_.push_back(Row(joint, rows.J_parent.row(i), rows.J_child.row(i)));
      }
    }
    for (const Drive& drive : m.drives) {
      const auto& on = std::get<JointDrive>(drive.kind);
      const ScalarRow row = DriveRow(m, drive, states_);
      const VecX J = Row(m.joints[on.joint], row.J_parent, row.J_child);
      if (std::isinf(drive.stiffness)) {
        constraints_.push_back(J);
      } else {
        K_ += drive.stiffness * J * J.transpose();
      }
    }
  }

  [[nodiscard]] Mat6 Compliance(int output) const {
    MatX A(constraints_.size(), K_.cols());
    for (size_t i = 0; i < constraints_.size(); ++i) A.row(i) = constraints_[i].transpose();
    const Eigen::JacobiSVD<MatX> svd(A, Eigen::ComputeFullV);
    const Eigen::Index rank = (svd.singularValues().array() > 1e-9).count();
    const MatX N = svd.matrixV().rightCols(K_.cols() - rank);
    const Output& out = m_.outputs[output];
    MatX G = MatX::Zero(6, K_.cols());
    const int node = NodeOf(out.body, out.X_BO.translation());
    const Vec3 arm = states_.X_WB[out.body].linear() * (out.X_BO.translation() - PointOf(node));
    G.block<3, 3>(0, 6 * node) = Mat3::Identity();
    G.block<3, 3>(3, 6 * node) = -Skew(arm);
    G.block<3, 3>(3, 6 * node + 3) = Mat3::Identity();
    const MatX K = N.transpose() * K_ * N, load = N.transpose() * G.transpose();
    // Free motions of links (idle spins) have no stiffness; scaling them makes that plain.
    const VecX scale = K.diagonal().cwiseMax(1e-12 * K.diagonal().maxCoeff()).cwiseSqrt();
    const VecX inverse = scale.cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<MatX> eigen(inverse.asDiagonal() * K *
                                                    inverse.asDiagonal());
    const MatX modes = eigen.eigenvectors().transpose() * inverse.asDiagonal() * load;
    Mat6 C = Mat6::Zero();
    for (Eigen::Index i = 0; i < modes.rows(); ++i) {
      const double k = eigen.eigenvalues()[i];
      if (k > 1e-10) C += modes.row(i).transpose() * modes.row(i) / k;
    }
    return C;
  }

 private:
  struct Node {
    int body;
    Vec3 p_B;
    bool elastic;
  };

  [[nodiscard]] int NodeOf(int body, const Vec3& p_B) const {
    for (size_t n = 0; n < nodes_.size(); ++n) {
      if (nodes_[n].body != body) continue;
      if (!nodes_[n].elastic || (nodes_[n].p_B - p_B).norm() < 1e-8) return static_cast<int>(n);
    }
    return -1;
  }
  [[nodiscard]] Vec3 PointOf(int node) const { return nodes_[node].p_B; }

  // J on [ω; v of the body's origin] → on [θ; u] of the node's own point.
  VecX Row(const Joint& joint, const Vec6& J_parent, const Vec6& J_child) const {
    VecX row = VecX::Zero(K_.cols());
    const auto put = [&](int body, const Vec3& p_B, const Vec6& J) {
      const int node = NodeOf(body, p_B);
      if (node < 0) return;
      const Vec3 arm = states_.X_WB[body].linear() * PointOf(node);
      // v_origin = u − θ × arm
      row.segment<3>(6 * node) += J.head<3>() - arm.cross(Vec3(J.tail<3>()));
      row.segment<3>(6 * node + 3) += J.tail<3>();
    };
    put(joint.parent, joint.X_PF.translation(), J_parent);
    put(joint.child, joint.X_CM.translation(), J_child);
    return row;
  }

  void AddBeam(const Beam& beam) {
    const int ends[2] = {NodeOf(beam.body, beam.p_from), NodeOf(beam.body, beam.p_to)};
    const Mat3 R = (states_.X_WB[beam.body].linear() * beam.R_BE).transpose();
    MatX T = MatX::Zero(12, K_.cols());
    for (int e = 0; e < 2; ++e) {
      T.block<3, 3>(6 * e, 6 * ends[e] + 3) = R;
      T.block<3, 3>(6 * e + 3, 6 * ends[e]) = R;
    }
    K_ += T.transpose() * TextbookBeam(beam) * T;
  }

  const Mechanism& m_;
  BodyStates states_;
  std::vector<Node> nodes_;
  std::vector<VecX> constraints_;
  MatX K_;
};

}  // namespace mbv::fixtures
