// The force method [Przemieniecki 1968, ch. 8]. With the members' deformations δ = B V by the
// nodes' twists V, and the output's displacement D = G V:
//
//   (1)  Bᵀ s = Gᵀ w                equilibrium of all nodes, w the load on the output
//   (2)  s = s0 + N y               a particular solution and the self-stresses, BᵀN = 0
//   (3)  Nᵀ F (s0 + N y) = 0        compatibility: of all equilibria, the one of least energy
//   (4)  C = SᵀF S                  S: member forces s under unit loads
//
// It is the dual of the direct stiffness method and gives the same C. Rigid members (F = 0), any
// number of redundant ones among them, and very stiff beams cost it no accuracy; idle motions (a
// rod that spins about its own axis) have no part in (1). The terms of the sum in (4) are the
// shares of the members.

#include "reference/frame_stiffness.h"

#include <fmt/format.h>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "base/demand.h"
#include "math/spatial.h"
#include "mechanism/reach.h"

namespace mbv::internal {
namespace {

// Points of an elastic body nearer than this are one node [characteristic lengths].
constexpr double kSamePoint = 1e-8;

// F = rootᵀ root of a beam clamped at `from`: deformation [rotation; displacement] of its end in
// beam axes by the moment and force there. Euler–Bernoulli: unit forces integrated over the length.
Mat6 BeamRoot(const Beam& beam, double length) {
  const double L = beam.length();
  const double EA = beam.youngs_modulus * beam.section.area;
  const double EI_y = beam.youngs_modulus * beam.section.I_y;
  const double EI_z = beam.youngs_modulus * beam.section.I_z;
  Mat6 F = Mat6::Zero();
  F(0, 0) = L / (beam.shear_modulus * beam.section.torsion);
  F(1, 1) = L / EI_y;
  F(2, 2) = L / EI_z;
  F(3, 3) = L / EA;
  F(4, 4) = L * L * L / (3.0 * EI_z);
  F(5, 5) = L * L * L / (3.0 * EI_y);
  F(2, 4) = F(4, 2) = L * L / (2.0 * EI_z);
  F(1, 5) = F(5, 1) = -L * L / (2.0 * EI_y);
  Vec6 scale = Vec6::Ones();
  scale.tail<3>() /= length;
  F = scale.asDiagonal() * F * scale.asDiagonal();
  return F.llt().matrixU();
}

}  // namespace

FrameModel::FrameModel(const Mechanism& mechanism, const std::vector<Pose>& X_WB, int output)
    : mechanism_(mechanism), length_(CharacteristicLength(mechanism)) {
  MBV_DEMAND(X_WB.size() == mechanism.bodies.size(), mechanism.name);
  MBV_DEMAND(output >= 0 && output < static_cast<int>(mechanism.outputs.size()), output);
  states_.Resize(X_WB.size());
  states_.X_WB = X_WB;
  AddNodes();
  for (const Beam& beam : mechanism.beams) AddBeam(beam);
  AddJoints();
  AddDrives();
  AddSprings();
  AddOutput(mechanism.outputs[output]);
  B_.resize(static_cast<Eigen::Index>(rows_.size()), 6 * static_cast<Eigen::Index>(nodes_.size()));
  for (size_t i = 0; i < rows_.size(); ++i) B_.row(static_cast<Eigen::Index>(i)) = rows_[i];
}

void FrameModel::AddNodes() {
  is_elastic_.assign(mechanism_.bodies.size(), false);
  for (const Beam& beam : mechanism_.beams) is_elastic_[beam.body] = true;
  for (size_t b = 1; b < mechanism_.bodies.size(); ++b) {
    if (!is_elastic_[b]) nodes_.push_back({.body = static_cast<int>(b)});
  }
  const auto add = [&](int body, const Vec3& p) {
    const bool known = std::any_of(nodes_.begin(), nodes_.end(), [&](const Node& node) {
      return node.body == body && (node.p_B - p).norm() < kSamePoint * length_;
    });
    if (!known) nodes_.push_back({body, p});
  };
  for (const Beam& beam : mechanism_.beams) {
    add(beam.body, beam.p_from);
    add(beam.body, beam.p_to);
  }
}

int FrameModel::NodeAt(int body, const Vec3& p_B, const std::string& what) {
  if (body == 0) return -1;
  for (size_t n = 0; n < nodes_.size(); ++n) {
    if (nodes_[n].body != body) continue;
    if (!is_elastic_[body] || (nodes_[n].p_B - p_B).norm() < kSamePoint * length_) {
      return static_cast<int>(n);
    }
  }
  summary_.stop = Stop::kUnsupported;
  summary_.message = fmt::format("{} sits on the elastic body '{}' where no beam ends", what,
                                 mechanism_.bodies[body].name);
  return -1;
}

void FrameModel::AddRow(int parent_node, const Vec6& J_parent, int child_node, const Vec6& J_child,
                        bool translation) {
  VecX row = VecX::Zero(6 * static_cast<Eigen::Index>(nodes_.size()));
  const double scale = translation ? 1.0 / length_ : 1.0;
  const auto put = [&](int node, const Vec6& J) {
    if (node < 0) return;
    row.segment<3>(6 * node) += scale * J.head<3>();
    row.segment<3>(6 * node + 3) += scale * length_ * J.tail<3>();
  };
  put(parent_node, J_parent);
  put(child_node, J_child);
  rows_.push_back(std::move(row));
}

// How the end moves against where it would be if the beam moved rigidly with its start.
void FrameModel::AddBeam(const Beam& beam) {
  const int from = NodeAt(beam.body, beam.p_from, beam.name);
  const int to = NodeAt(beam.body, beam.p_to, beam.name);
  const Mat3 R_EW = (states_.X_WB[beam.body].linear() * beam.R_BE).transpose();
  // The end, from the body's origin.
  const Vec3 p_W = states_.X_WB[beam.body].linear() * beam.p_to;
  Mat6 J = Mat6::Zero();  // [ω; v of the origin] → [ω; v of the end] in beam axes
  J << R_EW, Mat3::Zero(), -R_EW * Skew(p_W), R_EW;
  elastic_.push_back({.name = beam.name,
                      .first_row = static_cast<int>(rows_.size()),
                      .rows = 6,
                      .root = BeamRoot(beam, length_)});
  for (int i = 0; i < 6; ++i) AddRow(from, -J.row(i), to, J.row(i), i >= 3);
}

void FrameModel::AddJoints() {
  for (const Joint& joint : mechanism_.joints) {
    const std::string what = fmt::format("joint '{}'", joint.name);
    const int parent = NodeAt(joint.parent, joint.X_PF.translation(), what);
    const int child = NodeAt(joint.child, joint.X_CM.translation(), what);
    const ConstraintRows rows = RowsOf(joint, states_, false);
    for (int i = 0; i < rows.rows; ++i) {
      AddRow(parent, rows.J_parent.row(i), child, rows.J_child.row(i), i < rows.translation_rows);
    }
  }
}

void FrameModel::AddSpringLine(const std::string& name, const ScalarRow& row, int parent_node,
                               int child_node, bool translation, double stiffness) {
  if (std::isfinite(stiffness)) {
    const double flexibility = 1.0 / stiffness / (translation ? length_ * length_ : 1.0);
    elastic_.push_back({.name = name,
                        .first_row = static_cast<int>(rows_.size()),
                        .rows = 1,
                        .root = MatX::Constant(1, 1, std::sqrt(flexibility))});
  }
  AddRow(parent_node, row.J_parent, child_node, row.J_child, translation);
}

void FrameModel::AddDrives() {
  for (const Drive& drive : mechanism_.drives) {
    const std::string what = fmt::format("drive '{}'", drive.name);
    int parent = -1, child = -1;
    if (const auto* leg = std::get_if<DistanceDrive>(&drive.kind)) {
      parent = NodeAt(leg->body_from, leg->p_from, what);
      child = NodeAt(leg->body_to, leg->p_to, what);
    } else {
      const Joint& joint = mechanism_.joints[std::get<JointDrive>(drive.kind).joint];
      parent = NodeAt(joint.parent, joint.X_PF.translation(), what);
      child = NodeAt(joint.child, joint.X_CM.translation(), what);
    }
    AddSpringLine(drive.name + " (servo)", DriveRow(mechanism_, drive, states_), parent, child,
                  PositionUnit(mechanism_, drive) == "m", drive.stiffness);
  }
  // Prescribed joints are held.
  for (const Prescribed& prescribed : mechanism_.prescribed) {
    const Joint& joint = mechanism_.joints[prescribed.joint];
    AddRow(NodeAt(joint.parent, joint.X_PF.translation(), joint.name),
           JointCoordinateRow(joint, 0, states_).J_parent,
           NodeAt(joint.child, joint.X_CM.translation(), joint.name),
           JointCoordinateRow(joint, 0, states_).J_child, IsLength(joint.kind, 0));
  }
}

void FrameModel::AddSprings() {
  for (const SpringDamper& spring : mechanism_.springs) {
    if (!(spring.stiffness > 0.0)) continue;
    Drive line;
    line.kind = DistanceDrive{.body_from = spring.body_from,
                              .p_from = spring.p_from,
                              .body_to = spring.body_to,
                              .p_to = spring.p_to};
    const std::string what = fmt::format("spring '{}'", spring.name);
    AddSpringLine(spring.name + " (spring)", DriveRow(mechanism_, line, states_),
                  NodeAt(spring.body_from, spring.p_from, what),
                  NodeAt(spring.body_to, spring.p_to, what), true, spring.stiffness);
  }
}

void FrameModel::AddOutput(const Output& output) {
  const std::string what = fmt::format("output '{}'", output.name);
  const Vec3 p_WO = states_.X_WB[output.body] * output.X_BO.translation();
  G_.setZero(6, 6 * static_cast<Eigen::Index>(nodes_.size()));
  const auto add = [&](int body, const Vec3& p_B, double sign) {
    const int node = NodeAt(body, p_B, what);
    if (node < 0) return;
    G_.block<3, 3>(0, 6 * node) += sign * Mat3::Identity();
    G_.block<3, 3>(3, 6 * node) -= sign / length_ * Skew(p_WO - states_.X_WB[body].translation());
    G_.block<3, 3>(3, 6 * node + 3) += sign * Mat3::Identity();
  };
  add(output.body, output.X_BO.translation(), 1.0);
  add(output.reference_body, output.X_RbR.translation(), -1.0);
}

std::string FrameModel::MostMovingJoint(const VecX& twists) const {
  std::string name;
  double most = 0.0;
  const auto rate = [&](int body, const Vec3& p_B, const Vec6& J) {
    for (size_t n = 0; n < nodes_.size(); ++n) {
      if (nodes_[n].body != body) continue;
      if (is_elastic_[body] && (nodes_[n].p_B - p_B).norm() >= kSamePoint * length_) continue;
      const auto V = twists.segment<6>(6 * static_cast<Eigen::Index>(n));
      return J.head<3>().dot(V.head<3>()) + length_ * J.tail<3>().dot(V.tail<3>());
    }
    return 0.0;
  };
  for (const Joint& joint : mechanism_.joints) {
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      const ScalarRow row = JointCoordinateRow(joint, c, states_);
      const double moved = std::abs(rate(joint.parent, joint.X_PF.translation(), row.J_parent) +
                                    rate(joint.child, joint.X_CM.translation(), row.J_child)) /
                           (IsLength(joint.kind, c) ? length_ : 1.0);
      if (moved <= most) continue;
      most = moved;
      name = joint.name;
    }
  }
  return name;
}

}  // namespace mbv::internal

namespace mbv {
namespace {

using internal::FrameMember;
using internal::FrameModel;

// Rows that are dependent to this share are dependent. Poses are closed to 1e-13.
constexpr double kRankTolerance = 1e-9;
// A motion of unit size that moves the output less than this does not move it.
constexpr double kMoves = 1e-6;
// A flexibility smaller than this times the largest one is none.
constexpr double kRigid = 1e-14;

/// Everything about equilibrium (1), whatever is elastic.
struct Statics {
  MatX loads;        ///< 6 × k: orthonormal loads that the members can carry
  MatX particular;   ///< rows × k: s0 under these loads
  MatX self_stress;  ///< rows × redundancy: N
  VecX idle;         ///< a motion without deformation that moves the output; empty if k = 6
};

Statics SolveStatics(const MatX& B, const MatX& G) {
  Eigen::ColPivHouseholderQR<MatX> qr(B.rows(), B.cols());
  qr.setThreshold(kRankTolerance);
  qr.compute(B);
  const Eigen::Index rank = qr.rank(), loose = B.cols() - rank;
  const auto R11 = qr.matrixR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
  // Motions that deform nothing, and how the output moves in them.
  MatX motions = MatX::Zero(B.cols(), loose);
  motions.topRows(rank) = -R11.solve(qr.matrixR().topRightCorner(rank, loose));
  motions.bottomRows(loose).setIdentity();
  motions = qr.colsPermutation() * motions;
  if (loose > 0) {
    motions = motions.householderQr().householderQ() * MatX::Identity(B.cols(), loose);
  }
  MatX moved = MatX::Zero(std::max<Eigen::Index>(loose, 6), 6);
  moved.topRows(loose) = (G * motions).transpose();
  const Eigen::JacobiSVD<MatX> svd(moved, Eigen::ComputeThinU | Eigen::ComputeFullV);
  const Eigen::Index free = (svd.singularValues().array() > kMoves).count();

  Statics out;
  out.loads = free == 0 ? MatX(Mat6::Identity()) : MatX(svd.matrixV().rightCols(6 - free));
  if (free > 0) out.idle = motions * svd.matrixU().col(0).head(loose);
  // Bᵀ s = Gᵀ w with B P = Q R: the forces in the independent rows.
  const MatX right = qr.colsPermutation().transpose() * (G.transpose() * out.loads);
  MatX s = MatX::Zero(B.rows(), out.loads.cols());
  s.topRows(rank) = R11.transpose().solve(right.topRows(rank));
  out.particular = qr.householderQ() * s;
  MatX last = MatX::Zero(B.rows(), B.rows() - rank);
  last.bottomRows(B.rows() - rank).setIdentity();
  out.self_stress = qr.householderQ() * last;
  return out;
}

/// rootᵀ root = F of all members; rows without flexibility left out.
MatX ElasticRows(const std::vector<FrameMember>& members, const MatX& forces) {
  Eigen::Index rows = 0;
  for (const FrameMember& member : members) rows += member.rows;
  MatX out(rows, forces.cols());
  rows = 0;
  for (const FrameMember& member : members) {
    out.middleRows(rows, member.rows) =
        member.root * forces.middleRows(member.first_row, member.rows);
    rows += member.rows;
  }
  return out;
}

Mat6 Symmetric(const Mat6& M) { return 0.5 * (M + M.transpose()); }

void SetSingular(const std::string& message, const std::string& where, StiffnessResult* result) {
  result->summary.stop = Stop::kSingular;
  result->summary.message = message;
  result->summary.where = where;
  result->summary.names_where = true;
}

/// K and C, or one of them, from the compliance C_W against the loads W that are carried.
void Invert(const FrameModel& frame, const Statics& statics, const MatX& C_W,
            StiffnessResult* result) {
  Vec6 scale = Vec6::Ones();  // unit [m; f L] per [m; f]
  scale.tail<3>().setConstant(frame.length());
  const auto k = static_cast<int>(statics.loads.cols());
  result->rank = k;
  if (k == 6) result->C = Symmetric(scale.asDiagonal() * C_W * scale.asDiagonal());
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(C_W);
  const auto& values = eigen.eigenvalues();
  const Eigen::Index rigid =
      k == 0 ? 0 : (values.array() <= kRigid * values.cwiseAbs().maxCoeff()).count();
  if (rigid == 0) {
    const Mat6 K = statics.loads * C_W.ldlt().solve(statics.loads.transpose());
    const Vec6 inverse = scale.cwiseInverse();
    result->K = Symmetric(inverse.asDiagonal() * K * inverse.asDiagonal());
  }
  if (k < 6) {
    const std::string joint = frame.MostMovingJoint(statics.idle);
    SetSingular(fmt::format("with all drives held the output is free to move in {} direction{}: "
                            "nothing holds joint '{}'",
                            6 - k, k < 5 ? "s" : "", joint),
                joint, result);
  } else if (rigid > 0) {
    SetSingular(fmt::format("nothing elastic carries {} of the six loads: K is infinite there, "
                            "C is given",
                            rigid),
                "", result);
  } else {
    result->summary = RunSummary::Done();
  }
}

}  // namespace

StiffnessResult FrameStiffness(const Mechanism& mechanism, const std::vector<Pose>& X_WB,
                               int output) {
  StiffnessResult result;
  const FrameModel frame(mechanism, X_WB, output);
  result.summary = frame.summary();
  if (frame.elastic().empty()) {
    result.summary.stop = Stop::kUnsupported;
    result.summary.message = "the model has neither beams nor servos with a stiffness";
  }
  if (!result.summary.ok()) return result;

  const Statics statics = SolveStatics(frame.compatibility(), frame.output_motion());
  // (3) as least squares: |root (s0 + N y)| → min.
  MatX S = statics.particular;
  if (statics.self_stress.cols() > 0) {
    const Eigen::CompleteOrthogonalDecomposition<MatX> least(
        ElasticRows(frame.elastic(), statics.self_stress));
    S -= statics.self_stress * least.solve(ElasticRows(frame.elastic(), S));
  }
  const MatX half = ElasticRows(frame.elastic(), S);
  Invert(frame, statics, half.transpose() * half, &result);
  if (statics.loads.cols() < 6) return result;
  Vec6 scale = Vec6::Ones();
  scale.tail<3>().setConstant(frame.length());
  for (const FrameMember& member : frame.elastic()) {
    const MatX part = member.root * S.middleRows(member.first_row, member.rows);
    const Mat6 C = part.transpose() * part;
    result.shares.push_back({member.name, scale.asDiagonal() * C * scale.asDiagonal()});
  }
  return result;
}

}  // namespace mbv
