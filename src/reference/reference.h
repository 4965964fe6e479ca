// The reference witness: a generic closed-loop solver for any Mechanism.
//
// Loop closure by Newton in maximal coordinates (joint rows + commands), velocities and
// accelerations from the same Jacobian, then Newton–Euler for every body with all joint reactions,
// drive forces and base reactions as unknowns; minimum norm where a reaction is statically
// indeterminate. No MuJoCo and no paper formula.
#pragma once

#include <functional>
#include <memory>

#include "base/run_summary.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

struct ReferenceOptions {
  double closure_tolerance_m = 1e-13;  ///< Newton's end, for a characteristic length of 1 m; or rad
  int max_iterations = 30;             ///< per sample, > 0
  int homotopy_steps = 40;             ///< at most at first, from home to the first sample; > 0
  bool reactions = true;               ///< record every joint's reaction channels
  /// Of a pose that is not reached, search what stays open: many times the work of reaching one.
  bool explain_unreached = true;
};

/// Where power comes from and goes to [W].
struct Powers {
  double base = 0.0, loads = 0.0, dampers = 0.0;  ///< put in; dampers ≤ 0
  double gravity = 0.0, springs = 0.0;            ///< put in by gravity and by elasticity
  double energy_rate = 0.0;                       ///< of kinetic energy, gravity's and springs'
  double input = kNan;                            ///< drives, base, loads and dampers
};
/// Energies [J]; gravity's counts from the world's origin.
struct Energies {
  double kinetic = 0.0, gravity = 0.0, springs = 0.0;
};

/// Everything the reference knows at one instant.
struct ReferenceSample {
  BodyStates states;
  DrivenSample driven;    ///< drives, then prescribed joints
  VecX drive_force;       ///< per drive
  VecX prescribed_force;  ///< per prescribed joint
  MatX reactions;         ///< joints × 6: [fx fy fz mx my mz] as ReactionChannels() defines
  MatX outputs;           ///< outputs × 6
  MatX output_velocity, output_acceleration;  ///< their time derivatives, outputs × 6
  DrivenSample joints;                        ///< Motion::RecordedJoints()
  /// Per force element, of those with dry friction: sign of the rate, 0 at rest (RestRate()).
  std::vector<int> friction_signs;
  /// Per force element: friction by its joint's load, μ r N, and its force along the coordinate;
  /// empty where none depends on it.
  VecX load_friction, load_force;
  VecX drive_band, prescribed_band;  ///< half-widths of what friction at rest leaves open
  double closure_position_m = kNan, closure_rotation_rad = kNan;
  double control = kNan;  ///< smallest singular value of loops and commands (dimensionless)
  Powers power;
  Energies energy;
  VecX work;  ///< free motion: since the start [J], as WorkChannels(); otherwise empty
};

/// Follows a motion sample by sample (warm start from the previous one).
class ReferenceSolver {
 public:
  ReferenceSolver(const Mechanism& mechanism, const Motion& motion,
                  const ReferenceOptions& options = {});
  ~ReferenceSolver();
  ReferenceSolver(ReferenceSolver&&) noexcept;

  /// Positions, velocities and accelerations only.
  [[nodiscard]] RunSummary Kinematics(const CommandSample& command, ReferenceSample* sample);
  /// Kinematics and forces.
  [[nodiscard]] RunSummary Dynamics(const CommandSample& command, ReferenceSample* sample);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct ReferenceRun {
  Trace trace;  ///< drive, output, prescribed, reaction, audit and energy channels
  RunSummary summary;
};
/// `commands` fills the values of the motion's commands at sample i, where they do not follow from
/// its profiles (a motion that something else reached). `reuse`: the trace of an earlier run of the
/// same mechanism, coordinates and options, whose channels and memory are taken over.
[[nodiscard]] ReferenceRun RunReference(
    const Mechanism& mechanism, const Motion& motion, const ReferenceOptions& options = {},
    const std::function<void(size_t i, CommandSample* command)>& commands = {}, Trace reuse = {});

}  // namespace mbv
