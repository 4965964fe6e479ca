#include "kinematics/tree_motion.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>

#include "kinematics/constraints.h"
#include "math/sparse.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "mechanism/motion.h"

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
namespace {

// Where the followed angles begin in BodyStates::turns: coordinates of all joints, then six of
// every output.
size_t FirstAngle(const Mechanism& mechanism) {
  return mechanism.elements.size() + mechanism.drives.size() + mechanism.prescribed.size();
}

size_t TurnIndex(const Mechanism& mechanism, const Coordinate& coordinate) {
  const auto index = static_cast<size_t>(coordinate.index);
  const auto component = static_cast<size_t>(coordinate.component);
  size_t at = mechanism.elements.size() + index;
  if (coordinate.kind == Coordinate::Kind::kDrive) return at;
  if (coordinate.kind == Coordinate::Kind::kPrescribed) return at + mechanism.drives.size();
  const bool joint = coordinate.kind == Coordinate::Kind::kJoint;
  at = FirstAngle(mechanism) + component;
  const size_t before = joint ? index : mechanism.joints.size();
  for (size_t j = 0; j < before; ++j) {
    at += static_cast<size_t>(DofsOf(mechanism.joints[j].kind));
  }
  return joint ? at : at + 6 * index;
}

std::vector<double>* AnglesOf(const Mechanism& mechanism, BodyStates* states) {
  const size_t first = FirstAngle(mechanism);
  if (states->turns.size() < first) FollowDriven(mechanism, states);
  if (states->turns.size() > first) return &states->turns;
  for (const Joint& joint : mechanism.joints) {
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      states->turns.push_back(joint.home[static_cast<size_t>(c)]);
    }
  }
  for (size_t o = 0; o < mechanism.outputs.size(); ++o) {
    for (int c = 0; c < 6; ++c) {
      const Coordinate at{Coordinate::Kind::kOutput, static_cast<int>(o), c};
      states->turns.push_back(HomeValue(mechanism, at));
    }
  }
  return &states->turns;
}

}  // namespace

void FollowAngles(const Mechanism& mechanism, const std::vector<FollowedAngle>& angles,
                  BodyStates* states) {
  if (angles.empty()) return;
  std::vector<double>& turns = *AnglesOf(mechanism, states);
  for (const FollowedAngle& angle : angles) {
    double& turn = turns[TurnIndex(mechanism, angle.coordinate)];
    turn = CoordinateRow(mechanism, angle.coordinate, *states, turn).value;
  }
}

void StartAngles(const Mechanism& mechanism, const std::vector<FollowedAngle>& angles,
                 BodyStates* states) {
  if (angles.empty()) return;
  std::vector<double>& turns = *AnglesOf(mechanism, states);
  for (const FollowedAngle& angle : angles) {
    if (angle.coordinate.kind != Coordinate::Kind::kOutput) continue;
    turns[TurnIndex(mechanism, angle.coordinate)] = angle.start;
  }
  FollowAngles(mechanism, angles, states);
}

void PredictAngles(const Mechanism& mechanism, const std::vector<FollowedAngle>& angles,
                   double dt_s, BodyStates* states) {
  if (angles.empty()) return;
  const std::vector<double> turns = *AnglesOf(mechanism, states);
  for (const FollowedAngle& angle : angles) {
    const size_t at = TurnIndex(mechanism, angle.coordinate);
    const ScalarRow row = CoordinateRow(mechanism, angle.coordinate, *states, turns[at]);
    states->turns[at] = row.value + dt_s * (RateOf(row, states->V_WB) +
                                            0.5 * dt_s * (RateOf(row, states->A_WB) + row.bias));
  }
}

double FollowedNear(const Mechanism& mechanism, const BodyStates& states,
                    const FollowedAngle& angle) {
  const size_t at = TurnIndex(mechanism, angle.coordinate);
  return at < states.turns.size() ? states.turns[at] : angle.start;
}

std::vector<double> InputsOf(const Mechanism& mechanism, const BodyStates& states,
                             const StateFunction& function) {
  std::vector<double> inputs;
  for (const StateFunction::Input& input : function.inputs) {
    const size_t at = TurnIndex(mechanism, input.coordinate);
    const double near = at < states.turns.size() ? states.turns[at] : input.near;
    const ScalarRow row = CoordinateRow(mechanism, input.coordinate, states, near);
    inputs.push_back(input.rate ? RateOf(row, states.V_WB) : row.value);
  }
  return inputs;
}

double ValueAtStates(const Mechanism& mechanism, const BodyStates& states,
                     const StateFunction& function, double t_s) {
  const int branch =
      function.number < 0
          ? kAnyBranch
          : states.Branch(mechanism.elements.size() + static_cast<size_t>(function.number));
  return function.At(t_s, InputsOf(mechanism, states, function), branch);
}

LoadSample AtStates(const Mechanism& mechanism, const BodyStates& states,
                    const LoadSample& sample) {
  LoadSample at = sample;
  if (sample.load == nullptr) return at;
  for (const Load::Following& part : sample.load->following) {
    Vec3& vector = part.component < 3 ? at.force : at.moment;
    vector[part.component % 3] += ValueAtStates(mechanism, states, part.function, sample.time_s);
  }
  return at;
}

double ForceAtStates(const Mechanism& mechanism, const BodyStates& states, const DriveForce& force,
                     double t_s) {
  const double given = Evaluate(force.force, t_s).value;
  if (!force.following) return given;
  return given + ValueAtStates(mechanism, states, *force.following, t_s);
}

RunSummary CheckForcesAt(const Mechanism& mechanism, const BodyStates& states, double t_s,
                         const std::vector<LoadSample>& samples,
                         const std::vector<DriveForce>& forces) {
  RunSummary summary = RunSummary::Done();
  const auto check = [&](const StateFunction& function, double at_s, const auto& path) {
    const std::vector<double> inputs = InputsOf(mechanism, states, function);
    const double value = function.value(at_s, inputs);
    if (!summary.ok() || std::isfinite(value)) return;
    summary = HasNoValue(mechanism, path(), function, at_s, inputs, value);
  };
  for (const LoadSample& sample : samples) {
    if (sample.load == nullptr) continue;
    for (const Load::Following& part : sample.load->following) {
      check(part.function, sample.time_s, [&] { return PathOf(*sample.load, part); });
    }
  }
  for (const DriveForce& force : forces) {
    if (force.following) check(*force.following, t_s, [&] { return PathOf(mechanism, force); });
  }
  for (size_t e = 0; e < mechanism.elements.size() && summary.ok(); ++e) {
    const auto* law = std::get_if<ExpressionLaw>(&mechanism.elements[e].law);
    if (law == nullptr) continue;
    const ScalarRow row = ElementRow(mechanism, e, states);
    const double rate = RateOf(row, states.V_WB), value = law->force(row.value, rate);
    if (!std::isfinite(value)) {
      summary = HasNoValue(mechanism.elements[e], t_s, row.value, rate, value);
    }
  }
  return summary;
}

}  // namespace mbv

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

namespace {

// More columns, and fewer entries than this share, are worth sparse factors; these need some
// damping.
constexpr Eigen::Index kMostDense = 300;
constexpr double kSparse = 0.1;

// With e = r + J s: least ½ μ |s|² + ½ |e|² where J s − e = −r.
std::optional<VecX> SparseDampedStep(const MatX& J, const VecX& r, double mu) {
  constexpr double kLeastDamping = 1e-12;
  const Eigen::Index n = J.cols(), size = n + J.rows();
  std::vector<Eigen::Triplet<double>> entries;
  for (Eigen::Index c = 0; c < n; ++c) {
    for (Eigen::Index i = 0; i < J.rows(); ++i) {
      if (J(i, c) != 0.0) entries.emplace_back(c, i, J(i, c));
    }
  }
  if (static_cast<double>(entries.size()) > kSparse * static_cast<double>(J.size())) return {};
  for (Eigen::Index i = 0; i < J.rows(); ++i) entries.emplace_back(n + i, i, -1.0);
  SparseLu::Matrix B(size, J.rows()), W(size, size);
  B.setFromTriplets(entries.begin(), entries.end());
  W.setIdentity();
  for (Eigen::Index c = 0; c < n; ++c) W.valuePtr()[c] = std::max(mu, kLeastDamping);
  SparseSaddle saddle;
  if (!saddle.Factor(W, B, 0.0)) return {};
  VecX x, y;
  saddle.Solve(VecX::Zero(size), -r, &x, &y);
  return x.allFinite() ? std::optional<VecX>(x.head(n)) : std::nullopt;
}

}  // namespace

VecX DampedStep(const MatX& J, const VecX& r, double mu) {
  if (J.cols() > kMostDense) {
    if (std::optional<VecX> s = SparseDampedStep(J, r, mu)) return *std::move(s);
  }
  MatX stacked(J.rows() + J.cols(), J.cols());
  stacked << J, std::sqrt(mu) * MatX::Identity(J.cols(), J.cols());
  VecX right = VecX::Zero(stacked.rows());
  right.head(r.size()) = -r;
  return stacked.householderQr().solve(right);
}

}  // namespace mbv::internal
