// The simulation witness: MuJoCo on the generated MJCF, forward in time or inverse per sample.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/run_summary.h"
#include "core/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

enum class SimulationMode { kForward, kInverse };
enum class Engine {
  kCorrected,  ///< J̇q̇ and exact drive references supplied (see docs/simulation.md)
  kStock,      ///< MuJoCo as it is
};

struct SimulationOptions {
  SimulationMode mode = SimulationMode::kForward;
  Engine engine = Engine::kCorrected;
  double step_s = 1e-3;          ///< integration step, > 0; samples fall on whole steps
  double loop_tc_steps = 2.0;    ///< time constant of the closures in steps, >= 2
  double drive_tc_steps = 50.0;  ///< time constant of the drives' guidance in steps, >= 2
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
  std::vector<std::string> warnings;  ///< MuJoCo's warnings
  /// Drives and prescribed joints whose force is not unique (a self-stress of the mechanism acts
  /// on them): what is reported is one choice of many.
  std::vector<std::string> not_unique;
};

/// `motion` gives duration, sample times and loads; `driven` gives the commanded motion, evaluated
/// once before the loop.
[[nodiscard]] SimulationRun Simulate(const Mechanism& mechanism, const Motion& motion,
                                     const DrivenMotion& driven, const SimulationOptions& options,
                                     const std::function<void(double)>& progress = {});

}  // namespace mbv
