// Newton–Euler for every body with all reactions, drive and base forces as unknowns. Internal to
// reference/.
#pragma once

#include <Eigen/QR>
#include <Eigen/SVD>
#include <vector>

#include "base/run_summary.h"
#include "base/types.h"
#include "math/sparse.h"
#include "mechanism/idle_spins.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "reference/reference.h"
#include "reference/row_set.h"
#include "reference/square_system.h"

// Which of many possible sets of forces is reported. Internal to reference/.

namespace mbv::internal {

class ClosureSolver;

/// Where statics leaves a choice, one set of forces is taken: first the norm of the driven forces
/// (drives and prescribed joints) is made least, then that of all forces.
class LeastForces {
 public:
  /// `self_stress` (forces × k) spans the forces that balance each other; `first_driven` and all
  /// later rows are driven. All forces in N: moments divided by the characteristic length.
  void Take(const MatX& self_stress, Eigen::Index first_driven, VecX* force);

 private:  // work space
  Eigen::HouseholderQR<MatX> qr_;
  Eigen::JacobiSVD<MatX> svd_;
  MatX Q_, driven_rows_, rest_;  ///< columns of length 1; those that leave driven forces alone
  VecX householder_, along_, share_, rest_share_;
};

/// A random self-stress, A · stress = 0, where `forces` solves A x = b for forces x: it has a share
/// in all forces that one acts on, and is round-off where there is none.
[[nodiscard]] VecX RandomSelfStress(const SparseLeastNorm& forces, const SparseLu::Matrix& A);
/// Whether self-stresses act on forces from `first` on.
[[nodiscard]] bool SelfStressReaches(const VecX& random_stress, Eigen::Index first);

class ForceSolver {
 public:
  /// `duration_s`: of the motion; it says what is at rest.
  ForceSolver(const Mechanism& mechanism, double duration_s);

  /// Fills forces, bands and reactions of `sample` from its states and driven motion. Where the
  /// equations leave a choice, LeastForces decide. Friction at rest is zero in forces and
  /// reactions; a band is Σ |∂(drive force)/∂(friction)| Fs over what rests, Fs by the load of the
  /// middle. `closure`: solved for these states; its rows and factors are taken where they are
  /// those of the forces.
  [[nodiscard]] RunSummary Solve(const std::vector<LoadSample>& loads, ReferenceSample* sample,
                                 ClosureSolver* closure = nullptr);

 private:
  void FillRows(const BodyStates& states, const ClosureSolver* closure);
  /// Takes the closure's rows and factors. False where the forces have others.
  [[nodiscard]] bool Share(ClosureSolver* closure);
  void SelectAtHome();
  [[nodiscard]] RunSummary SelectBasis();
  [[nodiscard]] bool Factor();
  [[nodiscard]] bool FactorSparse();
  void FindSelfStress();
  [[nodiscard]] RunSummary CheckControl(const BodyStates& states);
  /// Into force_; Missing() of the result.
  double LeastNorm(const VecX& wrenches);
  /// The largest force, moments divided by the characteristic length.
  [[nodiscard]] double Largest(const VecX& wrenches) const;
  /// Largest of what force_ misses of the wrenches, which is left in missing_.
  double Missing(const VecX& wrenches);
  void Report(const VecX& force, ReferenceSample* sample) const;
  void FindBands(ReferenceSample* sample);
  /// To force_.
  [[nodiscard]] RunSummary AddLoadFriction(ReferenceSample* sample);
  [[nodiscard]] RunSummary CheckLoadsUnique(const ReferenceSample& sample,
                                            const std::vector<size_t>& loaded);
  [[nodiscard]] MatX ReactionsOf(const VecX& force, const BodyStates& states) const;
  void TakeRoundoff(VecX* driven) const;

  const Mechanism& mechanism_;
  const double length_, lever_, duration_s_;
  SquareSystem system_;
  SquareSystem* used_ = &system_;  ///< or the closure's
  const std::vector<Spin> spins_;  ///< idle
  RowSet rows_;  ///< AddReactionRows(), drives, prescribed joints, idle spins: these are given none
  int first_driven_ = 0;  ///< row of the first drive
  std::vector<int> basis_, rest_;
  bool basis_is_new_ = true, chosen_ = false;
  int orientation_ = 0;       ///< sign of the determinant so far, where the forces are unique
  MatX self_stress_;          ///< scaled; empty where least_ is in use
  SparseLu::Matrix columns_;  ///< of all rows, scaled
  SparseLeastNorm least_;     ///< of many self-stresses that leave the driven forces alone
  bool sparse_ = false;
  // Work space: per body, of the moving bodies, per row.
  std::vector<Vec6> required_, have_;
  VecX wrenches_, missing_, scale_, force_, part_, scaled_;
  LeastForces least_forces_;
};

/// Rows of a joint that transmit forces, its first ones: of one that transmits a force only, three.
[[nodiscard]] int ReactionRows(const Joint& joint);
/// Rows of all joints, with the isostatic rule applied, then of all couplings: what they can
/// transmit.
void AddReactionRows(const Mechanism& mechanism, const BodyStates& states, RowSet* rows);
/// joints × 6 as ReactionChannels() defines, then a row per coupling that begins with its force,
/// from the forces of AddReactionRows(), which come first in `rows` and `force`; returns their
/// number.
int FillReactions(const Mechanism& mechanism, const BodyStates& states, const RowSet& rows,
                  const VecX& force, MatX* reactions);

/// A spring's length and its gradient.
[[nodiscard]] ScalarRow LengthRow(const SpringDamper& spring, const Mechanism& mechanism,
                                  const BodyStates& states);

/// Wrench [m about Bo; f] that each body needs beyond gravity and its compensation, springs, force
/// elements and loads, in world axes: m a_cm and I ε + ω × I ω about the centre of mass, moved to
/// the origin. `friction_signs`: FrictionDirections().
void RequiredWrenches(const Mechanism& mechanism, const BodyStates& states,
                      const std::vector<LoadSample>& loads, const std::vector<int>& friction_signs,
                      std::vector<Vec6>* wrench_W);

/// M R per body, of motions R (6·bodies × n), rotors included.
[[nodiscard]] MatX Momenta(const Mechanism& mechanism, const BodyStates& states, const MatX& R);

[[nodiscard]] Energies EnergyOf(const Mechanism& mechanism, const BodyStates& states);
/// Powers but for the base and the input.
[[nodiscard]] Powers PowersOf(const Mechanism& mechanism, const BodyStates& states,
                              const std::vector<LoadSample>& loads,
                              const std::vector<int>& friction_signs);
/// Energies and all powers of a sample whose forces and driven motion are known.
void AuditSample(const Mechanism& mechanism, const std::vector<LoadSample>& loads,
                 ReferenceSample* sample);

}  // namespace mbv::internal
