// Accelerations of a mechanism whose motion follows from forces. Internal to reference/.
//
// With the scaled Jacobian J of all joint rows and commands, of rank n − f (n: body coordinates, f:
// DOFs that move by forces), orthogonal factors at the present pose (row_factors.h) give an
// orthonormal basis R of the motions they leave:
//   J R = 0                                                                                    (1)
//   A = A_p + R u̇,  A_p = J⁺(ẍ − b)  (least norm)                                             (2)
//   RᵀM R u̇ = Rᵀ(F − w(A_p))                                                                  (3)
// with w(A) = M A + … what Newton–Euler asks of each body beyond gravity, springs, force elements
// and loads (rotors count in M and w), and F the wrenches of the forced drives. Reactions drop out
// of (3); massless bodies need no inertia as long as RᵀM R has it [Udwadia, Kalaba 1996; García de
// Jalón, Bayo 1994, ch. 5]. Redundant rows cost nothing, and no choice of rows outlives a pose.
//
// Elements of dry friction slide in a given direction, or are held: then u̇ keeps their coordinates
// at rest, and the least change of R u puts poses and rates back there (rest_decision.h). Those
// whose coordinate loops and commands prescribe have the direction of their rate.
//
// Friction by the joints' loads (element_forces.h) moves the DOFs, and they the loads: with u̇_0
// and reactions of the state without it, and g_d = Rᵀ∇q_d,
//   u̇ = u̇_0 + Σ_d F_d a_d,  H a_d = g_d (what is held stays),                                  (4)
//   p_e: load by A_p + R u̇_0,  P_ed: load by M R a_d − ∇q_d alone                             (5)
// give eq. (2) there, which is solved as in commanded motion; held elements bear v_e, too.
#pragma once

#include <Eigen/QR>
#include <functional>
#include <vector>

#include "base/run_summary.h"
#include "base/types.h"
#include "kinematics/tree_motion.h"
#include "mechanism/idle_spins.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/element_forces.h"
#include "reference/motion_equations.h"
#include "reference/reference.h"
#include "reference/rest_decision.h"
#include "reference/row_factors.h"
#include "reference/row_set.h"

// Polynomials through values and derivatives. Internal to reference/.

namespace mbv::internal {

/// The polynomial of degree 2n − 1 that has given values and derivatives at n times.
class Hermite {
 public:
  /// Times distinct; one value and one derivative per time, all of one size.
  Hermite(const std::vector<double>& times, const std::vector<VecX>& values,
          const std::vector<VecX>& derivatives);

  /// Value and derivative at t.
  void Evaluate(double t, VecX* value, VecX* derivative) const;

 private:
  std::vector<double> nodes_;       ///< each time twice
  std::vector<VecX> coefficients_;  ///< of Newton's form
};

/// What every element of dry friction does.
struct FrictionPhase {
  std::vector<int> sign;     ///< per force element: of the rate with which it slides; otherwise 0
  std::vector<size_t> held;  ///< those that stick, and rigid stops in touch, increasing …
  std::vector<double> at = {};     ///< … and the values of their coordinates [m or rad]
  std::vector<size_t> prescribed;  ///< those whose rate gives their sign
};

class FreeDynamics {
 public:
  /// Both outlive the object. motion.initial.size() DOFs move by forces.
  FreeDynamics(const Mechanism& mechanism, const Motion& motion);

  /// A_WB at t from X_WB and V_WB. kSingular where the pose leaves more DOFs than that, where
  /// one of them has no inertia, or where friction by loads is not determined; kUnsupported where
  /// redundant constraints share such a load.
  [[nodiscard]] RunSummary Accelerate(double t_s, BodyStates* states);
  /// The same within a step from the poses projected last, by the rows that were independent there
  /// (motion_equations.h); by Accelerate() where these do not serve, and with friction that rests
  /// or follows loads.
  [[nodiscard]] RunSummary AccelerateNear(double t_s, BodyStates* states);

  /// In which phase friction is from now on; all others but Factor() depend on it.
  void SetPhase(FrictionPhase phase) { phase_ = std::move(phase); }
  [[nodiscard]] const FrictionPhase& phase() const { return phase_; }
  /// The held elements at the last Accelerate().
  [[nodiscard]] const RestSystem& rest() const { return rest_; }
  /// Share of its coordinate's motion that loops and commands leave to forces, after Accelerate().
  [[nodiscard]] double ShareLeft(const ScalarRow& row) const {
    return factors_.ShareLeft(GradientOf(row, mechanism_.bodies.size()));
  }

  /// Poses onto the loops and commands at t by Newton with the least correction, then velocities;
  /// `moved` (if given) is the size of the correction of the pose [rad, characteristic lengths].
  [[nodiscard]] RunSummary Project(double t_s, BodyStates* states, double* moved = nullptr);

  /// Reactions, forces of all drives and prescribed joints, powers and energies, from complete
  /// states; LeastForces where statics leaves a choice.
  void Forces(double t_s, ReferenceSample* sample);

  /// Powers that WorkChannels() integrates, from complete states.
  [[nodiscard]] VecX WorkRates(double t_s, const BodyStates& states);
  [[nodiscard]] Eigen::Index works() const {
    return static_cast<Eigen::Index>(mechanism_.drives.size() + mechanism_.prescribed.size()) + 2;
  }

  /// RowFactors::pivot() of the last factorisation: 0 where the loops lose a constraint.
  [[nodiscard]] double pivot() const { return factors_.pivot(); }
  /// Name of the joint that moves most in the motion that the weakest row hardly holds.
  [[nodiscard]] std::string SoftJoint(const BodyStates& states) const;

  /// Factors the rows at a pose, for pivot() and Motions().
  void Factor(double t_s, const BodyStates& states);
  /// Largest translation and rotation residual over all joints.
  void Gaps(const BodyStates& states, double* position_m, double* rotation_rad) const;

  [[nodiscard]] bool has_load_friction() const { return !loaded_.empty(); }
  [[nodiscard]] double length() const { return length_; }
  [[nodiscard]] int dofs() const { return dofs_; }
  /// Basis R of the last factorisation, scaled back: 6·bodies × DOFs.
  [[nodiscard]] MatX Motions() const { return factors_.Motions(); }

 private:
  /// Largest residual [rad, characteristic lengths] of the rows last factored; NaN if one is.
  [[nodiscard]] double LargestOpen() const;
  /// What rounding leaves of them at these poses.
  [[nodiscard]] double Rounding(const BodyStates& states) const;
  /// What rests, per held coordinate: gradients (held × 6·bodies), how far they are from where they
  /// are held, and their accelerations where no body accelerates.
  struct Held {
    MatX gradients;
    VecX gaps, bias;
  };
  [[nodiscard]] Held HeldRows(const BodyStates& states) const;
  /// The least of the motions left that changes held coordinates by `amount`.
  [[nodiscard]] VecX MotionOfHeld(const MatX& rows, const VecX& amount) const;
  void FillRest(const BodyStates& states, const VecX& A_p, const MatX& R);
  /// FrictionPhase::sign, with those of what is prescribed.
  [[nodiscard]] std::vector<int> SignsAt(const BodyStates& states) const;
  /// All that bears forces that are not given: reactions, drives, prescribed joints, what is held.
  /// Sparse, where idle spins and the coordinates of the initial values, which then exert nothing,
  /// make them as many as the equations, and statics determines what drives; else by orthogonal
  /// factors.
  struct ForceRows {
    RowSet rows;
    int first_driven = 0, first_prescribed = 0, first_held = 0;
    VecX scale;
    MatX self_stress;  ///< scaled forces that balance each other; one of them if sparse
    [[nodiscard]] VecX Solve(const VecX& scaled_wrenches) const;

    SparseLu::Matrix columns;                 ///< scaled wrenches of unit forces
    const SparseLeastNorm* sparse = nullptr;  ///< valid until the next ForceRowsAt()
    MatX dense;                               ///< columns of `rows`
    Eigen::CompleteOrthogonalDecomposition<MatX> factors;
    void FactorDense();
  };
  /// `held`: with what is held.
  [[nodiscard]] ForceRows ForceRowsAt(const BodyStates& states, bool held);
  [[nodiscard]] bool FactorSparse(const BodyStates& states, bool held, ForceRows* at);
  /// Motion of the DOFs by f, what is held at rest.
  [[nodiscard]] VecX MotionBy(const VecX& f);
  /// (4), (5): finds load_friction_ at states.A_WB = A_p + R u̇_0 and adds it to rest_.
  [[nodiscard]] RunSummary AddLoadFriction(double t_s, const BodyStates& states, const MatX& R,
                                           const VecX& A_p);
  [[nodiscard]] LoadSystem LoadsAt(double t_s, const ForceRows& at, const BodyStates& states,
                                   const MatX& R, MatX* along);
  void TakeLoads(const LoadSystem& system, const MatX& along, const RestSystem& without,
                 const std::vector<BearingLoad>& v);
  [[nodiscard]] RunSummary FollowHeld(double t_s, const ForceRows& loops, const BodyStates& states,
                                      const MatX& R, const VecX& A_p,
                                      const std::function<void()>& take,
                                      std::vector<BearingLoad>* v);
  /// Reactions by what bodies need, joints × 6.
  [[nodiscard]] MatX ReactionsBy(const ForceRows& at, const BodyStates& states,
                                 const VecX& wrenches) const;
  /// Wrenches that bodies need beyond all forces but reactions, what is solved for, and friction by
  /// load and at rest (6·bodies).
  [[nodiscard]] VecX NeededWrenches(double t_s, const BodyStates& states) const;
  [[nodiscard]] RunSummary CheckLoadsUnique(const ForceRows& at, const BodyStates& states) const;
  /// Forces of friction by load along the coordinates, as wrenches (6·bodies).
  [[nodiscard]] VecX LoadFrictionWrenches(const BodyStates& states) const;
  void FindPrescribedBands(const ForceRows& at, ReferenceSample* sample) const;
  void SolveForces(double t_s, ReferenceSample* sample);
  /// Per drive: the given force at t, or the next of those solved for.
  [[nodiscard]] VecX GivenOr(double t_s, const BodyStates& states, const VecX& solved) const;
  void AddDriveForces(double t_s, const BodyStates& states, std::vector<Vec6>* wrench_W) const;
  [[nodiscard]] RunSummary CheckDofs(double t_s) const;
  void FillRows(double t_s, const BodyStates& states);
  void ChooseNear();
  [[nodiscard]] RunSummary Singular(double t_s, const BodyStates& states) const;

  const Mechanism& mechanism_;
  const Motion& motion_;
  const double length_, lever_;
  const int size_, dofs_;
  const std::vector<Spin> spins_;  ///< idle: their rows stand between couplings and commands
  const std::vector<FollowedAngle> followed_;
  VecX body_scale_;
  RowSet rows_;
  int joint_rows_ = 0;
  CommandSample command_;
  std::vector<std::vector<double>> near_values_;  ///< per command, per term
  RowFactors factors_;
  FrictionPhase phase_;
  RestSystem rest_;
  MotionEquations near_;
  const SquareSystem scales_;
  SparseLeastNorm forces_;
  const std::vector<size_t> loaded_;  ///< elements with friction by load
  /// Per element, at the last Accelerate(): S, and the force (1) of element_forces.h.
  VecX load_friction_, load_force_;
};

}  // namespace mbv::internal
