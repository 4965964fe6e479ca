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

#include "reference/frame_model.h"

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
