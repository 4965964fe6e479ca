// Generic constraint rows of a Mechanism in maximal coordinates (one pose per body).
//
// With V the twists and A the accelerations of body_states.h, a row's residual r is differentiated
// as  ṙ = J V  and  r̈ = J A + b.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "base/types.h"
#include "mechanism/idle_spins.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Up to six scalar rows between two bodies.
struct ConstraintRows {
  int rows = 0;
  int translation_rows = 0;  ///< these come first; the rest are rotation rows
  int parent = 0, child = 0;
  Vec6 residual = Vec6::Zero();  ///< first `rows` entries: m for translation rows,
                                 ///< direction cosines (≈ rad) for rotation rows
  /// rows × 6, multiply V of the parent and of the child
  Eigen::Matrix<double, 6, 6, Eigen::RowMajor> J_parent = Mat6::Zero(), J_child = Mat6::Zero();
  Vec6 bias = Vec6::Zero();  ///< b in r̈ = J A + b
};

/// Rows that a joint imposes (6 − DOFs). With `reactions` true, the isostatic rule is applied:
/// a joint that transmits a force only has its three translation rows and no others. `biases`
/// false: velocities do not count, biases are zero.
[[nodiscard]] ConstraintRows RowsOf(const Joint& joint, const BodyStates& states, bool reactions,
                                    bool biases = true);

/// One scalar coordinate with its Jacobian on two bodies: value, ċ = J V, c̈ = J A + b. Multiplying
/// Jᵀ by a drive force gives the wrenches (about the body origins, world axes) of the drive.
struct ScalarRow {
  int parent = 0, child = 0;
  double value = 0.0;
  Vec6 J_parent = Vec6::Zero(), J_child = Vec6::Zero();
  double bias = 0.0;
};

/// J V: the coordinate's rate where `twists` are the bodies' velocities, without b its acceleration
/// where they are their accelerations.
[[nodiscard]] inline double RateOf(const ScalarRow& row, const std::vector<Vec6>& twists) {
  return row.J_parent.dot(twists[static_cast<size_t>(row.parent)]) +
         row.J_child.dot(twists[static_cast<size_t>(row.child)]);
}

/// A coordinate of a joint; angles are returned within ±π of `near_value`.
[[nodiscard]] ScalarRow JointCoordinateRow(const Joint& joint, int coordinate,
                                           const BodyStates& states, double near_value = 0.0);
[[nodiscard]] ScalarRow DriveRow(const Mechanism& mechanism, const Drive& drive,
                                 const BodyStates& states, double near_value = 0.0);
/// Component 0…5 (x, y, z, roll, pitch, yaw) of an output.
[[nodiscard]] ScalarRow OutputRow(const Output& output, int component, const BodyStates& states,
                                  double near_value = 0.0);
/// Coordinate 0…5 of a bushing (Bushing).
[[nodiscard]] ScalarRow BushingRow(const Bushing& bushing, int coordinate,
                                   const BodyStates& states);
[[nodiscard]] ScalarRow CoordinateRow(const Mechanism& mechanism, const Coordinate& coordinate,
                                      const BodyStates& states, double near_value = 0.0);

// Couplings of joint coordinates as constraint rows.
//
// The row Σ_k P_k(q_k) + constant = 0 is differentiated as
//   ṙ = Σ_k P_k′ q̇_k,  r̈ = Σ_k (P_k′ q̈_k + P_k″ q̇_k²).

/// A coupling's row: the sum of its pieces.
struct CouplingRow {
  std::vector<ScalarRow> pieces;    ///< per term; the constant is in the first
  std::vector<double> coordinates;  ///< per term: q_k, which counts turns
  bool angular = true;              ///< all coordinates are angles
  double value = 0.0;               ///< of the sum: in the unit of the coordinates

  [[nodiscard]] double LargestPiece() const;  ///< |P_k(q_k)|, which the sum's rounding follows
};

/// The rows of all couplings at poses, with velocities for the bias, in the turns that
/// `states.coupled` counts.
[[nodiscard]] std::vector<CouplingRow> CouplingRows(const Mechanism& mechanism,
                                                    const BodyStates& states);

/// The same, and brings `states->coupled` to the poses, which lie within half a turn of those it
/// was last brought to (or of home).
void FollowCouplings(const Mechanism& mechanism, BodyStates* states,
                     std::vector<CouplingRow>* rows);
void FollowCouplings(const Mechanism& mechanism, BodyStates* states);

/// How many turns the coupled coordinates count at the joints' guesses, for poses near them.
[[nodiscard]] std::vector<double> CoupledGuesses(const Mechanism& mechanism);

/// Coordinates by joint and number.
using CoordinateSet = std::set<std::pair<int, int>>;
/// Gives the one coordinate of a coupling that is not `known` the value that the others ask for, in
/// any turn, and counts it as known; for as long as there is such a coupling. `q`: by joint.
void SolveFollowers(const Mechanism& mechanism, CoordinateSet* known,
                    std::vector<std::array<double, 6>>* q);

/// Names of the coupled joints, for messages: "wheel, pinion".
[[nodiscard]] std::string CoupledJoints(const Mechanism& mechanism, const Coupling& coupling);

// Coordinates of force elements as rows, and which turn their angles and those of drives are in.

/// The coordinates of all force elements at poses, in the rotations that `states.turns` counts,
/// with velocities for the bias.
[[nodiscard]] std::vector<ScalarRow> ElementRows(const Mechanism& mechanism,
                                                 const BodyStates& states);
[[nodiscard]] ScalarRow ElementRow(const Mechanism& mechanism, size_t element,
                                   const BodyStates& states);
/// The same of drives, then of prescribed joints.
[[nodiscard]] ScalarRow DrivenRow(const Mechanism& mechanism, size_t driven,
                                  const BodyStates& states);

/// Brings the elements' part of `states->turns` to the poses, which lie within half a turn of those
/// it was last brought to (or of home).
void FollowElements(const Mechanism& mechanism, BodyStates* states);
/// The same for drives and prescribed joints.
void FollowDriven(const Mechanism& mechanism, BodyStates* states);

/// What `states->coupled` and `states->turns` are likely to be `dt_s` later, by velocities and
/// accelerations. To be called before the poses are moved there, where angles may turn by more than
/// half a turn.
void PredictTurns(const Mechanism& mechanism, double dt_s, BodyStates* states);

// The rows of idle spins (mechanism/idle_spins.h, eq. 3): ṙ = n·ω, r̈ = n·ε. There is no r: the turn
// about n is left where it is, so its value is always 0.

[[nodiscard]] inline ScalarRow IdleRow(const Spin& spin, const BodyStates& states) {
  ScalarRow row;
  row.child = spin.bodies[0];
  row.J_child.head<3>() = states.X_WB[static_cast<size_t>(row.child)].linear() * spin.n_B;
  return row;
}

// First variations of rows (internal::VariedPair) where the poses are moved by the small twists
// `by`, per body, and velocities stay: `value`, J and `bias` are δr, δJ and δb.

[[nodiscard]] ConstraintRows VariedRowsOf(const Joint& joint, const BodyStates& states,
                                          const std::vector<Vec6>& by, bool reactions);
[[nodiscard]] ScalarRow VariedRow(const Mechanism& mechanism, const Coordinate& coordinate,
                                  const BodyStates& states, const std::vector<Vec6>& by);
[[nodiscard]] ScalarRow VariedDriveRow(const Mechanism& mechanism, const Drive& drive,
                                       const BodyStates& states, const std::vector<Vec6>& by);
[[nodiscard]] std::vector<CouplingRow> VariedCouplingRows(const Mechanism& mechanism,
                                                          const BodyStates& states,
                                                          const std::vector<Vec6>& by);
[[nodiscard]] ScalarRow VariedElementRow(const Mechanism& mechanism, size_t element,
                                         const BodyStates& states, const std::vector<Vec6>& by);
[[nodiscard]] inline ScalarRow VariedIdleRow(const Spin& spin, const BodyStates& states,
                                             const std::vector<Vec6>& by) {
  ScalarRow row = IdleRow(spin, states);
  const Vec3 n = row.J_child.head<3>();
  row.J_child.head<3>() = by[static_cast<size_t>(row.child)].head<3>().cross(n);
  return row;
}

// Axes that are almost, but not quite, parallel: a typing slip that freezes a planar loop.

struct TiltedAxis {
  int joint = -1;  ///< its axis is tilted
  int other = -1;  ///< against that of this joint
  int body = 0;    ///< that carries both
  double angle_rad = kNan;
  int dofs = 0;          ///< of the mechanism as it is
  int dofs_aligned = 0;  ///< with the two axes parallel (perpendicular: slide and hinge)
};

/// Looks for a joint whose axis misses those beside it by a small angle, where aligning it closes
/// loops that do not close at home, or gives DOF to a mechanism that has too little for its
/// drives. Nothing if aligning changes neither: then the angle is meant.
[[nodiscard]] std::optional<TiltedAxis> FindTiltedAxis(const Mechanism& mechanism,
                                                       bool closed_at_home);

}  // namespace mbv

// What always holds, by rates of the spanning tree. Internal to kinematics/.

namespace mbv::internal {

/// The rate of a row per unit of each motion: `J` has the twists of all bodies (6·bodies × motions,
/// TreeMotion::Jacobian).
[[nodiscard]] Eigen::RowVectorXd RowAlong(const ScalarRow& row, const MatX& J);

/// Closures, couplings, then idle spins, as speeds: rows × motions. Rotations count by `length`.
[[nodiscard]] MatX LoopRows(const Mechanism& mechanism, const std::vector<Spin>& spins,
                            const BodyStates& states, const MatX& J, double length);

}  // namespace mbv::internal
