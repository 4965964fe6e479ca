// The simulation witness: MuJoCo on the generated MJCF, forward in time or inverse per sample.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/run_summary.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

enum class Engine {
  kCorrected,  ///< J̇q̇ and exact drive references supplied (see docs/explanation/simulation.md)
  kStock,      ///< MuJoCo as it is, by the best recipe from outside (stiff, rates in the targets)
  kDefaults,   ///< MuJoCo as it is by default: soft constraints, positions as targets
};

/// Forces of all drives, in model order [N or N m], at any time of the scenario.
using DriveForces = std::function<RunSummary(double t_s, VecX* force)>;

/// Gains of every drive, in model order: [N/m or N m/rad], [N s/m or N m s/rad].
struct ServoGains {
  VecX kp, kv;
};

struct SimulationOptions {
  /// kForceDriven and kServo: the corrected engine, and every DOF commanded.
  DriveMode mode = DriveMode::kPrescribedMotion;
  Engine engine = Engine::kCorrected;
  double step_s = 1e-3;  ///< integration step, > 0; samples fall on whole steps
  /// Time constant with which closures and driven coordinates are pulled back to their commanded
  /// motion (corrected engine), in steps, >= 20: stiffer guidance destabilises the integration,
  /// softer guidance lets errors live longer.
  double guidance_steps = 50.0;
  /// Time constant of the generated file's equality constraints (stock engine), in steps, >= 2:
  /// MuJoCo itself raises smaller ones.
  double stock_time_constant_steps = 2.0;
  /// Stock engine: MuJoCo's Runge–Kutta method instead of its semi-implicit Euler method. Targets
  /// and loads stay as they are within a step.
  bool runge_kutta = false;
  DriveForces forces = {};  ///< kForceDriven: the forces; kServo: feed-forward, or empty
  ServoGains servo = {};    ///< kServo only
  /// Free motion only: poses and twists of all bodies at t = 0. They are put onto the loops of the
  /// simulated model, with the prescribed coordinates where they are commanded.
  BodyStates start = {};
};
[[nodiscard]] Diagnostics Check(const SimulationOptions& options);

/// Motion of everything driven (drives, then prescribed joints) at any time of the scenario.
using DrivenMotion = std::function<RunSummary(double t_s, DrivenSample* driven)>;

struct SimulationRun {
  Trace trace;  ///< drive, output, prescribed, closure-reaction and audit channels
  RunSummary summary;
  MatX qpos;                            ///< samples × nq, MuJoCo's configuration, for pictures
  std::vector<std::vector<Pose>> X_WB;  ///< per sample, per body of the mechanism
  std::string mjcf;                     ///< the model as simulated
  long steps = 0;
  double loop_wall_s = 0.0;           ///< time in the step loop
  double loop_cpu_s = 0.0;            ///< processor time of this thread in the step loop
  std::vector<std::string> warnings;  ///< MuJoCo's warnings
  std::vector<std::string> notes;     ///< what a reader must know of the step
  /// Drives and prescribed joints whose force is not unique (a self-stress of the mechanism acts
  /// on them): what is reported is one choice of many.
  std::vector<std::string> not_unique;
};

/// `motion` gives duration, sample times, loads, forces of drives and the times at which profiles
/// break (the integration steps onto them); of a free motion `driven` counts for the commanded
/// drives and prescribed joints only; `driven` gives the commanded motion, evaluated before the
/// loop, as are the forces. Fails with what `driven` returned; kNoConvergence (the loops do not
/// close with the commanded drive positions); kUnsupported (undriven DOFs or a free motion in
/// inverse mode, a load on a merged body, a drive on a ball); kEngineFailure (MuJoCo's errors,
/// motion not finite, loops apart, a step that springs or servos cannot be followed with). Samples
/// up to the failure are filled, the others NaN.
[[nodiscard]] SimulationRun Simulate(const Mechanism& mechanism, const Motion& motion,
                                     const DrivenMotion& driven, const SimulationOptions& options,
                                     const std::function<void(double)>& progress = {});

}  // namespace mbv
