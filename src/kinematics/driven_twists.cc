// From the null space N of the joints' rows: the rates of all driven coordinates are D x for twists
// N x, so that one of them moves alone at x = D⁺ e.
#include "kinematics/driven_twists.h"

#include <Eigen/Dense>
#include <functional>

#include "kinematics/row_stack.h"
#include "mechanism/motion.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

using internal::FindRank;
using internal::NullSpaces;
using internal::RowStack;

// A motion that a drive hardly sees at home (a dead centre) would get any size: it is left out.
constexpr double kSeen = 1e-3;
// Twists below this share of the largest one are round-off.
constexpr double kMoves = 1e-9;

BodyStates HomeOrFirstStates(const Mechanism& mechanism) {
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  if (!mechanism.X_WB_home.empty()) states.X_WB = mechanism.X_WB_home;
  return states;
}

// Rows of the driven coordinates (scaled as RowStack does) in terms of x; not held ones are zero.
MatX DrivenRows(const Mechanism& mechanism, const BodyStates& states, double length,
                const std::vector<bool>& held, const MatX& N) {
  RowStack stack(mechanism.bodies.size(), length);
  stack.AddDriven(mechanism, states);
  MatX D = stack.Matrix() * N;
  for (size_t d = 0; d < held.size(); ++d) {
    if (!held[d]) D.row(static_cast<Eigen::Index>(d)).setZero();
  }
  return D;
}

// Unscales the columns of X = N x: twists [ω; v] of every body, per column.
std::vector<std::vector<Vec6>> Twists(const MatX& X, size_t bodies, double length) {
  std::vector<std::vector<Vec6>> twists;
  for (Eigen::Index k = 0; k < X.cols(); ++k) {
    std::vector<Vec6> V(bodies, Vec6::Zero());
    for (size_t b = 1; b < bodies; ++b) {
      V[b] = X.col(k).segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
      V[b].tail<3>() *= length;
    }
    twists.push_back(std::move(V));
  }
  return twists;
}

// Kinetic energy is xᵀ M x / 2; massless motions get a little, so that M can be inverted.
MatX MassMatrix(const Mechanism& mechanism, const BodyStates& states,
                const std::vector<std::vector<Vec6>>& basis) {
  constexpr double kMassless = 1e-12;
  const auto n = static_cast<Eigen::Index>(basis.size());
  MatX M = MatX::Zero(n, n);
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    const Body& body = mechanism.bodies[b];
    const Mat3 R_WB = states.X_WB[b].linear();
    const Vec3 r_W = R_WB * body.p_BoBcm_B;
    MatX w(3, n), v(3, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Vec6& V = basis[static_cast<size_t>(k)][b];
      w.col(k) = V.head<3>();
      v.col(k) = V.tail<3>() + V.head<3>().cross(r_W);
    }
    M += body.mass * v.transpose() * v + w.transpose() * R_WB * body.I_Bcm_B * R_WB.transpose() * w;
  }
  const double least = kMassless * M.trace();
  M.diagonal().array() += least > 0.0 ? least : 1.0;
  return M;
}

// One column per driven coordinate: the x at which it alone has the rate 1 (in scaled units).
MatX MoveAlone(const MatX& D, const std::function<MatX()>& mass_matrix) {
  const MatX one = MatX::Identity(D.rows(), D.rows());
  Eigen::CompleteOrthogonalDecomposition<MatX> all(D.rows(), D.cols());
  all.setThreshold(kSeen);
  all.compute(D);
  if (all.rank() == D.cols()) return all.solve(one);
  const MatX response = mass_matrix().ldlt().solve(MatX(D.transpose()));
  const MatX A = D * response;
  const VecX size = A.diagonal().cwiseSqrt();
  const VecX scale = (size.array() > 0.0).select(size.cwiseInverse(), 0.0);
  Eigen::CompleteOrthogonalDecomposition<MatX> scaled(A.rows(), A.cols());
  scaled.setThreshold(kSeen * kSeen);
  scaled.compute(scale.asDiagonal() * A * scale.asDiagonal());
  return response * (scale.asDiagonal() * scaled.solve(MatX(scale.asDiagonal() * one)));
}

// Bodies that move in some x with the prescribed joints at rest.
std::vector<bool> Movable(const MatX& N, const MatX& prescribed, size_t bodies) {
  MatX free = N;
  if (prescribed.rows() > 0 && N.cols() > 0) {
    free = N * FindRank(prescribed, NullSpaces::kMotion).motion;
  }
  std::vector<bool> moved(bodies, false);
  const double largest = free.size() == 0 ? 0.0 : free.cwiseAbs().maxCoeff();
  for (size_t b = 1; b < bodies && largest > 0.0; ++b) {
    const auto rows = free.middleRows<6>(6 * (static_cast<Eigen::Index>(b) - 1));
    moved[b] = rows.cwiseAbs().maxCoeff() > kMoves * largest;
  }
  return moved;
}

}  // namespace

DrivenTwists TwistsOfDriven(const Mechanism& mechanism, const std::vector<bool>& held) {
  const size_t bodies = mechanism.bodies.size();
  const double length = CharacteristicLength(mechanism);
  const BodyStates states = HomeOrFirstStates(mechanism);
  RowStack joints(bodies, length);
  joints.AddJoints(mechanism, states, false);
  const MatX N = FindRank(joints.Matrix(), NullSpaces::kMotion).motion;
  const MatX D = DrivenRows(mechanism, states, length, held, N);
  const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
  DrivenTwists out;
  out.moved = Movable(N, D.bottomRows(D.rows() - drives), bodies);
  if (D.rows() == 0 || D.cols() == 0) {
    out.V_WB.assign(static_cast<size_t>(D.rows()), std::vector<Vec6>(bodies, Vec6::Zero()));
    return out;
  }
  const MatX X =
      N * MoveAlone(D, [&] { return MassMatrix(mechanism, states, Twists(N, bodies, length)); });
  out.V_WB = Twists(X, bodies, length);
  // The rows of lengths were divided by L: their unit rate is 1 m/s, not L.
  for (size_t k = 0; k < out.V_WB.size(); ++k) {
    const bool is_drive = k < mechanism.drives.size();
    const bool metres =
        is_drive
            ? PositionUnit(mechanism, mechanism.drives[k]) == "m"
            : IsLength(
                  mechanism.joints[mechanism.prescribed[k - mechanism.drives.size()].joint].kind,
                  0);
    for (Vec6& V : out.V_WB[k]) V *= metres ? 1.0 / length : 1.0;
  }
  return out;
}

}  // namespace mbv
