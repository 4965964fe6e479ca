// Loop closure: poses, velocities and accelerations of all bodies under the commands. Internal to
// reference/.
//
// Newton in maximal coordinates on an independent subset of the joint rows plus one row per
// command; the matrix is factored once near the solution and then refined against. Redundant joint
// rows are dropped and their residuals checked. Idle spins (mechanism/idle_spins.h) have a row
// each: no Newton step turns them, and their rates are zero. From sample to sample their lines are
// transported parallel (math/spatial.h); the first sample takes the least turn from
// home.
#pragma once

#include <array>
#include <vector>

#include "base/run_summary.h"
#include "kinematics/tree_motion.h"
#include "math/rate_extrapolation.h"
#include "math/spatial.h"
#include "mechanism/idle_spins.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "mechanism/reach.h"
#include "reference/reference.h"
#include "reference/row_set.h"
#include "reference/square_system.h"

namespace mbv::internal {

// Where all bodies will be at the next sample of a motion, and how they will move there
// (math/rate_extrapolation.h). Internal to reference/.

class PosePredictor {
 public:
  explicit PosePredictor(double length) : length_(length) { times_s_.fill(kNan); }

  /// States of a sample, with twists and accelerations.
  void Remember(double time_s, const BodyStates& states);
  /// From the sample remembered last to dt later, > 0; by as many samples as lie dt apart and agree
  /// with the last one alone.
  void Predict(double dt_s);
  /// Twists times dt, stacked.
  [[nodiscard]] const VecX& step() const { return step_; }
  /// Twists and accelerations there, stacked.
  [[nodiscard]] const VecX& V() const { return V_; }
  [[nodiscard]] const VecX& A() const { return A_; }
  [[nodiscard]] double last_s() const { return times_s_[0]; }

 private:
  [[nodiscard]] int Usable(double dt_s) const;

  double length_;
  std::array<double, kMostRateSamples> times_s_;  ///< newest first
  RateHistory history_;
  VecX step_, by_one_, V_, A_;
};

class ClosureSolver {
 public:
  ClosureSolver(const Mechanism& mechanism, const Motion& motion, const ReferenceOptions& options);

  /// Brings states() to the command, from the previous sample's or from the home pose.
  [[nodiscard]] RunSummary Solve(const CommandSample& command);

  [[nodiscard]] const BodyStates& states() const { return states_; }
  /// Of all joints, couplings, commands and idle spins at the pose of states().
  [[nodiscard]] const RowSet& rows() const { return rows_; }
  /// The first row of the commands.
  [[nodiscard]] int first_command() const { return joint_rows_; }
  /// Those of joints and couplings that transmit forces.
  [[nodiscard]] const std::vector<int>& transmitting() const { return transmitting_; }
  /// Rows that are as many as the unknowns.
  [[nodiscard]] const std::vector<int>& selection() const { return selection_; }
  /// They are all that transmit forces and those of all drives, all prescribed joints and idle
  /// spins, in this order.
  [[nodiscard]] bool selection_is_of_forces() const {
    return commands_are_driven_ && selection_.size() == transmitting_.size() + free_rows() &&
           std::equal(transmitting_.begin(), transmitting_.end(), selection_.begin());
  }
  /// Factors of the selection at states() or a pose of the way there.
  [[nodiscard]] SquareSystem& system() { return system_; }

  /// Other velocities and accelerations at the pose of states().
  [[nodiscard]] RunSummary SolveRates(const CommandSample& command);
  /// Twists of the moving bodies, stacked, per unit rate of each of the first `count` commands.
  [[nodiscard]] RunSummary UnitMotions(int count, MatX* motions);
  /// First variations of rows() at states(), biases included, along twists of all bodies.
  void VaryRows(const std::vector<Vec6>& by, RowSet* varied) const;
  /// Largest translation and rotation residual over all joints.
  [[nodiscard]] double gap_position_m() const { return gap_position_m_; }
  [[nodiscard]] double gap_rotation_rad() const { return gap_rotation_rad_; }
  /// Smallest singular value of the rows at the last pose (estimate, dimensionless).
  [[nodiscard]] double control() const { return control_; }

 private:
  enum class Step { kDone, kSlow, kFar, kSingular };

  // Where a pose search stands: everything that is thrown away if it fails.
  struct Trial {
    BodyStates states;
    std::vector<std::vector<double>> near_values;  ///< per command, per term
  };

  [[nodiscard]] RunSummary Prepare();
  /// Of joints without biases, unless they are asked for.
  void EvaluateRows(Trial* trial, bool biases = false);
  /// What the selected rows miss of the target, into missing_; the largest as a multiple of its
  /// tolerance, NaN if one is.
  [[nodiscard]] double Openness(const VecX& target, const std::vector<Pose>& X_WB);
  /// Gap that rounding leaves at these poses [m].
  [[nodiscard]] double Rounding(const std::vector<Pose>& X_WB) const {
    return GapRounding(Reach(lever_, X_WB));
  }
  [[nodiscard]] size_t free_rows() const { return commands_.size() + spins_.size(); }
  [[nodiscard]] Step Newton(const VecX& target, bool limit_step, Trial* trial);
  [[nodiscard]] RunSummary Follow(const VecX& target, int first_steps);
  /// Into how many steps a way is cut first: by the motion that the bodies begin it with, step_,
  /// which would be the whole way were it straight.
  [[nodiscard]] int StepsTo(const VecX& target);
  /// The determinant has changed its sign since the last pose.
  [[nodiscard]] bool Turned() const {
    return orientation_ != 0 && system_.determinant_sign() != orientation_;
  }
  void FindTransmitting();
  /// `of_forces`: of rows that transmit forces, where these are enough.
  [[nodiscard]] RunSummary SelectRows(bool of_forces);
  /// Chooses among redundant rows anew at states(), where those chosen before may have become
  /// dependent although the mechanism is regular there. False if it is not.
  [[nodiscard]] bool SelectAnew();
  [[nodiscard]] double ControlAtHome();
  /// Turns idle spins back by these angles.
  [[nodiscard]] RunSummary TurnBack(const std::vector<double>& turns);
  [[nodiscard]] RunSummary TakeLeastTurns();
  [[nodiscard]] RunSummary TransportTurns(const CommandSample& command);
  [[nodiscard]] MovingDirection LineOf(const Spin& spin) const;
  /// Of the rows last evaluated; returns the joint row with the largest.
  int MeasureGaps();
  /// Gaps and smallest singular value at states(), with another choice of rows if need be.
  [[nodiscard]] RunSummary CheckPose();
  [[nodiscard]] RunSummary CheckHere();
  void EvaluateHere();
  /// What the selected rows miss of the rates, into missing_; the largest [rad, characteristic
  /// lengths].
  double Miss(const VecX& rates, const std::vector<Vec6>& per_body);
  /// Adds the motions that the factors give to what is missing; returns their size.
  double AddMissing(std::vector<Vec6>* per_body);
  struct Refinement {
    double change = 0.0;  ///< the sum of all [rad/s, characteristic lengths per s]
    bool accurate = false;
  };
  /// Solves the selected rows for the bodies' motions, from those at hand. Misses of `round_off`
  /// [1/s of angles, characteristic lengths per s, or these per s] are none.
  Refinement Refine(const VecX& rates, double round_off, std::vector<Vec6>* per_body);
  [[nodiscard]] RunSummary Singular(const std::string& why) const;
  /// Exchanges states and turns with those of the trial.
  void Accept(const VecX& target, Trial* trial);
  [[nodiscard]] std::string OwnerOf(int joint_row) const;

  const Mechanism& mechanism_;
  const ReferenceOptions options_;
  const double length_, lever_;
  std::vector<Command> commands_;  ///< of the motion, then prescribed joints held at home
  const std::vector<Spin> spins_;  ///< idle
  const std::vector<FollowedAngle> followed_;
  const bool commands_are_driven_;
  SquareSystem system_;
  RowSet rows_;  ///< all joint rows and couplings, then the command rows, then idle spins
  int first_coupling_ = 0, joint_rows_ = 0;
  std::vector<double> coupled_size_;  ///< per coupling: its largest piece, for rounding
  std::vector<int> transmitting_, selection_;
  bool selection_is_new_ = true;
  bool rows_are_here_ = false;  ///< rows_ are those of states_, but for biases
  int orientation_ = 0;         ///< sign of the determinant on this branch

  BodyStates states_;
  std::vector<std::vector<double>> near_values_;
  VecX target_;  ///< command positions of states_; zero for idle spins
  // Work space.
  Trial trial_;
  std::vector<CouplingRow> coupled_;
  VecX next_target_, rates_;  ///< per row
  VecX missing_, step_;       ///< per selected row; twists of the moving bodies
  PosePredictor predictor_;
  struct LastLine {
    MovingDirection line;
    Mat3 R_WB;
  };
  std::vector<LastLine> last_lines_;  ///< of the last sample, per spin; empty: there is none
  double gap_position_m_ = kNan, gap_rotation_rad_ = kNan;
  double control_ = kNan;
};

/// Moves all bodies by small twists: R ← exp(δω) R, p ← p + δv; keeps rotations orthonormal.
void MoveBodies(const VecX& stacked_twists, BodyStates* states);

// Why a command cannot be followed. Internal to reference/.

/// Explains a failure to reach `target` (one entry per command) from the nearest pose that was
/// reached: kUnreachable with the loop that stays open, by least squares with the commands held;
/// kSingular if the target can be reached after all, but not along the commanded way.
/// `near_values` per command and term. The time is left to the caller.
[[nodiscard]] RunSummary ExplainUnreached(const Mechanism& mechanism,
                                          const std::vector<Command>& commands, const VecX& target,
                                          const BodyStates& nearest,
                                          std::vector<std::vector<double>> near_values);

/// Name of the joint that moves most in the motion given by stacked body twists (scaled by a
/// characteristic length).
[[nodiscard]] std::string MostMovingJoint(const Mechanism& mechanism, const BodyStates& states,
                                          const VecX& stacked_twists);

}  // namespace mbv::internal
