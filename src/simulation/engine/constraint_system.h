// MuJoCo's equality constraints as a system r(q) = 0 with Jacobian J and bias J̇q̇.
//
// Rows: the closures in plan order, the couplings, then the prescribed coordinates (drives without
// a given force, prescribed joints). The residual of a prescribed row is position − target.
// MuJoCo 2.2.2 has no J̇q̇ in its reference accelerations; it is computed here from MuJoCo's own cvel
// and cdof_dot:
//
//   bias acceleration of body b (spatial, about the root's centre of mass c):
//     A0_b = A0_parent + Σ_j cdof_dot_j q̇_j                                                   (1)
//   classical acceleration of a point p of b for q̈ = 0:
//     a0_p = A0_lin + A0_ang × (p − c) + ω × v_p,  v_p = v_c + ω × (p − c)                     (2)
//   connect, translation of a weld:  bias = a0_p1 − a0_p2                                      (3)
//   rotation of a weld, r = Im(q2⁻¹ q1 q_rel), w = ω1 − ω2 (world):
//     bias = ½ Im(q2⁻¹ ((α0_1 − α0_2) + ½ (w ω1 − ω2 w)) q1 q_rel)   (quaternion products)     (4)
//   tendon of length L from p1 to p2, u = (p2 − p1)/L, w = v_p2 − v_p1:
//     bias = u·(a0_p2 − a0_p1) + (w·w − (u·w)²)/L                                              (5)
//   joint: bias = 0.
//   coupling q1 − ref1 = P(x), x = q2 − ref2: bias = −P″(x) q̇2²; of a fixed tendon 0         (6)
#pragma once

#include <vector>

#include "base/types.h"
#include "math/sparse.h"
#include "simulation/engine/engine_model.h"

namespace mbv::simulation {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Where the model asks for sparse Jacobians, MuJoCo's constraint stages run on such; everything
/// else, tendons too, finds dense ones.
class ConstraintSystem {
 public:
  /// Both outlive the system. `d` is the state that all functions work on.
  ConstraintSystem(const EngineModel& engine, mjData* d);

  [[nodiscard]] int rows() const { return rows_; }
  /// Of closures and couplings.
  [[nodiscard]] int closure_rows() const { return closure_rows_; }
  [[nodiscard]] int driven_rows() const { return rows_ - closure_rows_; }
  /// Row of driven coordinate k, or -1 if its force is given.
  [[nodiscard]] int driven_row(int k) const { return driven_row_[k]; }
  /// Adds the multiple of a vector over all driven coordinates to the rows that they have.
  void AddPrescribed(double factor, const VecX& per_driven, VecX* per_row) const {
    for (Eigen::Index k = 0; k < per_driven.size(); ++k) {
      const int row = driven_row_[static_cast<size_t>(k)];
      if (row >= 0) (*per_row)[row] += factor * per_driven[k];
    }
  }

  /// Forces of the drives that have no row, per driven coordinate.
  void SetGivenForces(const VecX& force) { given_ = force; }
  /// Force of driven coordinate k: its constraint's, or the given one.
  [[nodiscard]] double DrivenForce(int k) const;
  /// dx/dq̇ of driven coordinate k at the present position.
  [[nodiscard]] VecX DrivenJacobian(int k) const;
  /// Its product with velocities or accelerations of MuJoCo.
  [[nodiscard]] double AlongDriven(int k, const double* x) const;
  /// J̇q̇ of driven coordinate k; after BodyBiasAccelerations() at the same state.
  [[nodiscard]] double DrivenBias(int k) const {
    const DrivenPlace& place = engine_.driven[static_cast<size_t>(k)];
    return place.is_tendon ? TendonBias(place.object) : 0.0;
  }
  /// Adds Jᵀ · given force to `qfrc` (nv).
  void AddGivenForces(double* qfrc) const;
  [[nodiscard]] bool has_given_forces() const {
    return driven_rows() < static_cast<int>(engine_.driven.size());
  }
  [[nodiscard]] int nv() const { return engine_.m->nv; }
  [[nodiscard]] const EngineModel& engine() const { return engine_; }
  [[nodiscard]] mjData* data() const { return d_; }

  /// Targets of the driven rows [m or rad].
  void SetTargets(const VecX& position);

  /// Kinematics, inertias about the centre of mass, tendons and constraint rows at d.qpos.
  void EvaluatePosition();
  [[nodiscard]] Eigen::Map<const VecX> residual() const { return {d_->efc_pos, rows_}; }
  /// Entries for every dof that can move an end of a row, of the last EvaluatePosition().
  [[nodiscard]] const SparseRows& J() const { return J_; }
  /// The same of rows that MuJoCo made by itself, in the dense format.
  void TakeJacobian();
  [[nodiscard]] Eigen::Map<VecX> force() const { return {d_->efc_force, rows_}; }

  /// Characteristic length L [m].
  [[nodiscard]] double length() const { return length_; }
  /// Units of the rows' residuals and of the velocities in which both are of the order one,
  /// whatever the mechanism's size: L for lengths, 1 for angles.
  [[nodiscard]] const VecX& row_unit() const { return row_unit_; }
  [[nodiscard]] const VecX& dof_unit() const { return dof_unit_; }
  /// J in these units.
  [[nodiscard]] MatX ScaledJ() const {
    return row_unit_.cwiseInverse().asDiagonal() * MatX(J_) * dof_unit_.asDiagonal();
  }
  /// Its transpose, sparse with a pattern that stays.
  void FillScaledTranspose(SparseLu::Matrix* columns) const;
  /// Rounding of residuals in these units: positions far from the world's origin and angles of many
  /// turns have few digits behind the point.
  [[nodiscard]] double Rounding() const;

  /// Forces of springs and of MuJoCo's own force elements at d.qpos, d.qvel into qfrc_passive.
  void EvaluatePassive();

  /// MuJoCo's recursion over the bodies at the data's position, velocity and qacc: accelerations
  /// (cacc) of the bodies, and the wrenches (cfrc_int) that inertia and gravity of each and of all
  /// that it carries need, constraints and loads left out.
  void EvaluateBodyForces();
  /// The generalized forces of that, M q̈ + bias without armature.
  void BodyForces(VecX* tau) const;

  /// J̇q̇ of a tendon's length; after Bias() at the same state.
  [[nodiscard]] double TendonBias(int tendon) const;

  /// Angular acceleration of a MuJoCo body at the data's qacc, world axes; after Bias() at the same
  /// state.
  [[nodiscard]] Vec3 AngularAcceleration(int body) const;

  /// What Bias() begins with: accelerations of the bodies at q̈ = 0.
  void BodyBiasAccelerations();
  /// J̇q̇ of every row, from positions and velocities evaluated by MuJoCo (mj_comVel).
  void Bias(VecX* bias);

  [[nodiscard]] int first_driven_row() const { return closure_rows_; }
  /// First row of a planned closure.
  [[nodiscard]] int closure_row(int closure) const { return closure_row_[closure]; }
  [[nodiscard]] int coupling_row(int coupling) const { return first_coupling_ + coupling; }

  /// Friction by the joints' loads that force() balances, per force element; empty: none.
  struct FrictionByLoad {
    VecX size = {};   ///< S of FrictionLaw
    VecX force = {};  ///< ε Q along the coordinate, at any rate
  };
  void SetLoadFriction(FrictionByLoad friction) { load_friction_ = std::move(friction); }
  [[nodiscard]] const FrictionByLoad& load_friction() const { return load_friction_; }
  /// Share of its force with which a force element acts (Switch), at a time.
  void SetEngaged(const Motion& motion, double t_s) { EvaluateSwitches(motion, t_s, &engaged_); }
  [[nodiscard]] double engaged(size_t element) const {
    return element < engaged_.size() ? engaged_[element] : 1.0;
  }
  [[nodiscard]] double load_friction(size_t element) const {
    const VecX& size = load_friction_.size;
    return size.size() == 0 ? 0.0 : size[static_cast<Eigen::Index>(element)];
  }
  [[nodiscard]] double load_force(size_t element) const {
    const VecX& force = load_friction_.force;
    return force.size() == 0 ? 0.0 : force[static_cast<Eigen::Index>(element)];
  }

  /// Rows of MuJoCo's frictionloss, behind the equalities (free motion with dry friction).
  [[nodiscard]] int friction_rows() const { return static_cast<int>(engine_.frictions.size()); }
  /// Unit of such a row as row_unit(), and its Jacobian.
  [[nodiscard]] double FrictionUnit(int row) const;
  [[nodiscard]] Eigen::Map<const VecX> FrictionJacobian(int row) const {
    const double* first = engine_.sparse ? friction_J_.data() : d_->efc_J + rows_ * nv();
    return {first + row * nv(), nv()};
  }
  /// Per force element: sign of the rate with which it slides, 0 at rest, where MuJoCo's row holds
  /// it up to its breakaway force. Empty: in free motion MuJoCo's rows do all of it; elsewhere the
  /// rate says.
  void SetSliding(std::vector<int> sign) { sliding_ = std::move(sign); }
  /// Per element: the branch by which an expression is taken.
  void SetBranches(std::vector<int> branches) { branches_ = std::move(branches); }
  [[nodiscard]] int branch(size_t element) const {
    return element < branches_.size() ? branches_[element] : kAnyBranch;
  }
  [[nodiscard]] const std::vector<int>& sliding() const { return sliding_; }
  /// Of an element with dry friction, by its joint's load too; of a rigid stop far beyond any.
  [[nodiscard]] double Breakaway(size_t element) const;
  /// Sum of the breakaway forces of what a row holds.
  [[nodiscard]] double HeldLoss(int row) const;
  /// Share of an element in the force of MuJoCo's row.
  [[nodiscard]] double HeldForce(size_t element) const;

  /// Largest gaps of the closures: |translation| [m] and rotation angle of welds [rad].
  struct Gap {
    double position_m = 0.0, rotation_rad = 0.0;
  };
  [[nodiscard]] Gap LargestGap() const;

 private:
  struct Point {
    Vec3 p, v, a0;  // position, velocity, bias acceleration [m, m/s, m/s²]
  };
  [[nodiscard]] Point PointOn(int body, const Vec3& p_W) const;
  void ClosureBias(int closure, VecX* bias) const;

  [[nodiscard]] bool IsLengthCoupling(size_t coupling) const;
  [[nodiscard]] double CouplingBias(int coupling) const;
  void FindUnits();
  void FindPattern();
  void TurnFrictionRows();
  void CheckRows() const;

  const EngineModel& engine_;
  mjData* const d_;
  const double length_, lever_;
  VecX row_unit_, dof_unit_;
  SparseRows J_;
  VecX J_unit_;          // of its entries
  RowMajor friction_J_;  // where MuJoCo's are sparse
  int rows_ = 0, first_coupling_ = 0, closure_rows_ = 0;
  std::vector<int> closure_row_, driven_row_;
  std::vector<bool> coupling_is_length_;
  VecX given_;
  FrictionByLoad load_friction_;
  std::vector<int> sliding_, branches_;
  std::vector<double> engaged_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> A0_;  // per MuJoCo body, (1)
};

}  // namespace mbv::simulation
