// What one simulation works with, and its three ways to run.
#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "math/spatial.h"
#include "mechanism/idle_spins.h"
#include "mechanism/motion.h"
#include "simulation/engine/closure_solver.h"
#include "simulation/engine/constraint_system.h"
#include "simulation/engine/loads.h"
#include "simulation/engine/recorder.h"
#include "simulation/engine/simulation.h"

// The time steps of a forward run: a uniform grid that carries the samples, and the times at which
// a commanded profile changes its formula.

namespace mbv::simulation {

struct Step {
  double from_s = 0.0, to_s = 0.0;
  int uniform = 0;   ///< smooth uniform nodes before `to_s`, `from_s` included (at most 4): what a
                     ///< multistep formula may use. 0 when the step itself is shorter.
  long sample = -1;  ///< index of the sample at `to_s`, or -1
};

/// Steps of length `step_s`, adjusted so that samples fall on whole steps; a step is divided where
/// some profile of the motion has a break.
[[nodiscard]] std::vector<Step> MakeSteps(const Motion& motion, double step_s);

/// The adjusted step [s].
[[nodiscard]] double AdjustedStep(const Motion& motion, double step_s);

// Idle spins (mechanism/idle_spins.h) in MuJoCo's coordinates. The constraints leave them open, and
// least-norm solutions would turn them as the units of the coordinates happen to share: here each
// is put where the motion has it.
//
//   the part hangs on the ball that comes first in the tree; w_i: world axes of that ball's
//   velocities, v_i: of the other ball's, if it is in the tree, too. The motion that spins the
//   part and nothing else is
//     q̇ = s ν,  ν_i = n·w_i,  ν_i = −n·v_i                                                      (1)
//   with J ν = 0. Over the velocities that turn the part, from the root to the first ball:
//     n·ω = Σ n·w_j q̇_j,  n·ε = Σ n·(w_j q̈_j + ẇ_j q̇_j)                                         (2)
//   and as n·ω of ν is 1, these become zero by q̇ −= (n·ω) ν, q̈ −= (n·ε) ν. In inverse mode, where
// nothing integrates, the lines are transported parallel from sample to sample
// (math/spatial.h); the first one takes the least turns from home.

class SpinStopper {
 public:
  /// The system outlives it.
  explicit SpinStopper(ConstraintSystem* system);

  [[nodiscard]] int count() const { return static_cast<int>(spins_.size()); }

  /// Puts d.qpos, where the solver has closed the loops for `first`, to the least turns from home.
  [[nodiscard]] RunSummary TakeLeastTurns(ClosureSolver* solver, const DrivenSample& first);
  /// Takes n·ω out of d.qvel. Evaluates mj_comVel.
  void StopVelocity();
  /// Takes n·ε out of d.qacc, at the velocity that mj_comVel was evaluated for.
  void StopAcceleration();
  /// Transports the lines to the state of time t_s, with velocity and acceleration, from that of
  /// the last call: where there was one, d.qpos is turned and closed again, and velocity and
  /// acceleration must be solved for anew (*turned).
  [[nodiscard]] RunSummary Transport(double t_s, const DrivenSample& at, ClosureSolver* solver,
                                     bool* turned);
  /// kUnsupported if τ, which closures and drives must balance, has a part along a spin.
  [[nodiscard]] RunSummary CheckIdle(const VecX& tau) const;

 private:
  struct Place {
    int first_dof = -1;      ///< of the ball on which the part hangs
    int second_dof = -1;     ///< of the other ball, if it is in the tree
    std::vector<int> chain;  ///< velocities that turn the part
  };
  // n; ω and ε of the part at the data's velocity and acceleration.
  [[nodiscard]] Vec3 Direction(size_t k) const;
  [[nodiscard]] Vec3 AngularVelocity(size_t k) const;
  [[nodiscard]] Vec3 AngularAcceleration(size_t k) const;
  [[nodiscard]] Mat3 RotationOf(size_t k) const;
  [[nodiscard]] VecX Motion(size_t k) const;
  void Turn(size_t k, double angle);

  ConstraintSystem* const system_;
  const std::vector<Spin> spins_;
  std::vector<Place> places_;
  mutable std::vector<Pose> X_WB_;
  struct LastLine {
    MovingDirection line;
    Mat3 R_WB;
  };
  std::vector<LastLine> last_lines_;  // of the last Transport(), per spin; empty: none
  double last_s_ = kNan;
};

/// What is commanded at one instant.
struct Commanded {
  DrivenSample motion;  ///< of everything driven
  VecX force;           ///< of the drives: applied or fed forward; empty if nothing is given
};

/// A state of MuJoCo.
struct EngineState {
  VecX qpos, qvel;
};

/// Everything one run needs. Members are used in place: a Session is not copied or moved.
struct Session {
  Session(EngineModel model, const Motion& motion_, const SimulationOptions& options_,
          SimulationRun* run_);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Stores sample i, the next one, and reports progress now and then.
  void Record(size_t i);
  /// Puts what Record() has kept into the run: samples in blocks, as its columns are far apart. The
  /// last ones when the session ends, however it does.
  void PutRecords();
  /// Work rates at the present state, as WorkChannels().
  [[nodiscard]] const VecX& WorkRates();
  /// Half-widths within which friction at rest leaves the forces of everything driven,
  /// Σ |∂(force)/∂(friction)| Fs: per element Jᵀλ = −u Fs, as forces are solved for.
  /// Where drives are released MuJoCo finds what holds, but for coordinates that are prescribed.
  [[nodiscard]] VecX Bands();
  /// True if forces depend on the accelerations and forces that MuJoCo finds.
  [[nodiscard]] bool follows() const { return released && (gyroscopic || !loaded.empty()); }
  /// Decides, at the present configuration, whether the drives share their forces.
  void FindShared();
  /// Loads, given drive forces and force elements that MuJoCo lacks at t, for the data's current
  /// position and velocity, into qfrc_applied; forces of servos into qfrc_actuator.
  /// Loads, and what is switched, at t.
  void EvaluateLoads(double t_s);
  void ApplyForces(double t_s, const Commanded& at);
  /// Masses at t into the model; before MuJoCo evaluates positions.
  void SetPayloads(double t_s);

  const EngineModel engine;
  const DataHandle data;
  const Motion& motion;
  const SimulationOptions& options;
  SimulationRun* const run;
  ConstraintSystem system;
  ClosureSolver solver;
  SpinStopper spins;
  Loads loads;
  Recorder recorder;
  WorkMeter work;
  UntilJump until;      ///< at which time forces are evaluated
  const bool released;  ///< the motion of some drive is not prescribed: friction and accelerations
                        ///< are MuJoCo's
  const std::vector<size_t> loaded;         ///< elements with friction by their joint's load
  RunSummary trouble = RunSummary::Done();  ///< in finding it
  const bool lacking;     ///< there are force elements that MuJoCo has no word for
  const bool gyroscopic;  ///< some of them need accelerations
  VecX work_rates;        ///< of the state that was asked for last
  /// A body whose mass changes, in MuJoCo's model, with all of its mass.
  struct Payload {
    int id = 0;
    size_t body = 0;
    double mass = 0.0;
    Vec3 inertia = Vec3::Zero();
  };
  std::vector<Payload> payloads;
  std::vector<double> carried;  ///< BodyStates::carried
  EngineState start;            ///< of a mechanism whose drives are force-controlled or servos
  bool shared = false;          ///< drive forces are not unique: the least ones are reported
  std::function<void(double)> progress;
  VecX given;             ///< forces that the driven coordinates are given
  bool diverged = false;  ///< the run ended because numbers or loops did not hold
  static constexpr Eigen::Index kBlock = 16;
  MatX records, qpos_records;      ///< samples that are not yet in the run: a column each
  Eigen::Index kept = 0, put = 0;  ///< how many, and how many are in the run
};

/// Wall and processor time of the loop over steps or samples.
class LoopClock {
 public:
  void Stop(SimulationRun* run) const {
    run->loop_wall_s = std::chrono::duration<double>(Clock::now() - wall_).count();
    run->loop_cpu_s = ComputingTime::ThreadSeconds() - cpu_s_;
  }

 private:
  using Clock = std::chrono::steady_clock;
  const Clock::time_point wall_ = Clock::now();
  const double cpu_s_ = ComputingTime::ThreadSeconds();
};

/// The modes. Start configuration: closed, at the first driven sample. Each fills the run's trace,
/// qpos and poses and returns how it ended.
[[nodiscard]] RunSummary RunInverse(Session* session, const DrivenMotion& driven);
[[nodiscard]] RunSummary RunCorrected(Session* session, const DrivenMotion& driven);
[[nodiscard]] RunSummary RunStock(Session* session, const DrivenMotion& driven);

/// MuJoCo's coordinates and velocities of body states. False if a joint has coordinates that body
/// states do not give one by one.
[[nodiscard]] bool PutStates(const EngineModel& engine, const Motion& motion,
                             const BodyStates& states, mjData* d);
/// Start of a free motion: options.start on the loops, prescribed coordinates at `first`.
[[nodiscard]] RunSummary PutAtFreeStart(Session* session, const DrivenSample& first);

/// Brings the system's data from home to the commanded start. Commands of outputs lead there by
/// MuJoCo's own kinematics, those of drives by the drive positions; the loops are closed at the
/// drive positions of `first`. A note says where the drive positions alone would have gone
/// elsewhere.
[[nodiscard]] RunSummary CloseAtStart(const Motion& motion, const DrivenSample& first,
                                      ConstraintSystem* system, ClosureSolver* solver,
                                      std::vector<std::string>* notes);
/// Start of a force-controlled or servo-driven mechanism: every drive and base on its command.
/// Needs the guiding constraints of all drives; leaves them switched on.
[[nodiscard]] RunSummary FindCommandedStart(const Motion& motion, const DrivenSample& first,
                                            EngineModel* engine, EngineState* start,
                                            std::vector<std::string>* notes);
/// Puts the session there, closed once more without the targets.
[[nodiscard]] RunSummary PutAtCommandedStart(Session* session, const DrivenSample& first);

/// Targets for MuJoCo's rows as they are. Of the stiffest impedance d and the time constant tc they
/// ask for aref = −b J q̇ − k d (x − target): the target is moved so that this is the commanded
/// acceleration where position and velocity are as commanded.
void TargetsWithRates(const DrivenSample& at, double time_constant_s, VecX* targets);

/// Positions of everything driven at home.
[[nodiscard]] VecX HomePositions(const EngineModel& engine);

/// MuJoCo's servos of all drives at the data's position and velocity: qfrc_actuator, and the force
/// of every drive.
void RunServos(const EngineModel& engine, const Commanded& at, mjData* d, VecX* force);

/// True if every entry is finite and below the size that MuJoCo itself takes for divergence.
[[nodiscard]] bool IsSane(const double* x, int n);

/// q ⊕ h v̄ in place, where v̄ is the mean velocity over the step; the coordinates of balls and free
/// rotations get the commutator term h²/12 (ω_0 × ω_1) of their rotation vector, without which a
/// turning axis costs an error of second order. v_0, v_1: velocities at the ends (nv).
void AdvancePositions(const EngineModel& engine, double h, const VecX& mean, const VecX& v_0,
                      const VecX& v_1, VecX* work, double* qpos);

}  // namespace mbv::simulation
