#include "verify/simulate_scenario.h"

#include <algorithm>
#include <cmath>

#include "base/demand.h"
#include "base/roles.h"
#include "reference/forward.h"
#include "verify/drive_by.h"
#include "verify/prepare.h"

namespace mbv {

SimulationOptions OptionsOf(const Scenario& scenario, const Mechanism& mechanism, Engine engine) {
  const SimulationSettings& settings = scenario.simulation;
  SimulationOptions options;
  options.engine = engine;
  options.step_s = settings.step_s;
  // Other engines are run on the prescribed motion.
  if (!settings.forward() || engine == Engine::kCorrected) options.mode = settings.mode;
  if (options.mode == DriveMode::kServo) options.servo = GainsOf(settings.servo, mechanism);
  return options;
}

Trace Extrapolate(const Trace& a, double at_a, const Trace& b, double at_b, double target) {
  MBV_DEMAND(a.values.rows() == b.values.rows() && a.values.cols() == b.values.cols(),
             a.values.rows());
  MBV_DEMAND(at_a != at_b, at_a);
  Trace trace = a;
  const double factor = (target - at_a) / (at_b - at_a);
  for (size_t c = 0; c < a.channels.size(); ++c) {
    const auto column = static_cast<Eigen::Index>(c);
    const Channel& channel = a.channels[c];
    if (channel.unit == "N" || channel.unit == "N m" || channel.unit == "W" ||
        channel.unit == "J") {
      trace.values.col(column) += factor * (b.values.col(column) - a.values.col(column));
    } else if (channel.quantity == Quantity::kLoopGap || channel.quantity == Quantity::kLoopTwist) {
      const auto worse = [](double x, double y) { return std::isnan(x) || x > y ? x : y; };
      trace.values.col(column) =
          a.values.col(column).cwiseAbs().binaryExpr(b.values.col(column).cwiseAbs(), worse);
    }
  }
  return trace;
}

namespace {

// From two models that are loaded anew; their forces are linear in the parameter.
void RunExtrapolated(const Scenario& scenario, const Mechanism& mechanism,
                     const DrivenMotion& driven, const SimulationOptions& options,
                     const std::function<void(double)>& progress, SimulatedWitness* witness) {
  MBV_DEMAND(!scenario.motion.free(), scenario.name);  // forces are not linear in it
  const Extrapolation& extrapolation = *scenario.simulation.extrapolate;
  const Overrides base = Merge(scenario.parameters, scenario.simulation.parameters);
  std::array<SimulationRun, 2> runs;
  for (size_t k = 0; k < 2; ++k) {
    const Mechanism variant = LoadVariant(
        scenario, mechanism, Merge(base, {{extrapolation.parameter, extrapolation.from[k]}}),
        role::kSimulated, &witness->diagnostics);
    if (witness->diagnostics.has_errors()) return;
    const auto half = [&](double fraction) {
      if (progress) progress(0.5 * (static_cast<double>(k) + fraction));
    };
    runs[k] = Simulate(variant, scenario.motion, driven, options, half);
    if (!runs[k].summary.ok()) {
      witness->run = std::move(runs[k]);
      return;
    }
  }
  const double target = mechanism.ParameterValue(extrapolation.parameter);
  Trace trace = Extrapolate(runs[0].trace, extrapolation.from[0], runs[1].trace,
                            extrapolation.from[1], target);
  witness->run = std::move(runs[0]);
  witness->run.trace = std::move(trace);
  witness->run.steps += runs[1].steps;
  witness->run.loop_wall_s += runs[1].loop_wall_s;
  witness->run.loop_cpu_s += runs[1].loop_cpu_s;
  witness->run.summary.wall_s += runs[1].summary.wall_s;
}

}  // namespace

SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                               const DrivenMotion& driven, const SimulationOptions& options,
                               const std::function<void(double)>& progress) {
  SimulatedWitness witness;
  const Diagnostics option_findings = Check(options);
  for (const Finding& finding : option_findings.findings()) {
    witness.diagnostics.AddError(scenario.file, "simulation: " + finding.message, finding.hint);
  }
  if (witness.diagnostics.has_errors()) return witness;
  if (scenario.simulation.extrapolate) {
    RunExtrapolated(scenario, mechanism, driven, options, progress, &witness);
    return witness;
  }
  SimulationOptions started = options;
  if (scenario.motion.free()) {
    witness.run.summary = InitialStates(mechanism, scenario.motion, &started.start);
    if (!witness.run.summary.ok()) return witness;
  }
  witness.run = Simulate(mechanism, scenario.motion, driven, started, progress);
  return witness;
}

SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                               const DrivenMotion& driven, Engine engine,
                               const std::function<void(double)>& progress) {
  return RunSimulation(scenario, mechanism, driven, OptionsOf(scenario, mechanism, engine),
                       progress);
}

}  // namespace mbv
