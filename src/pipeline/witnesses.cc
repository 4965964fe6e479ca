#include "pipeline/witnesses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/demand.h"
#include "core/text.h"
#include "model_file/load_model.h"
#include "pipeline/drive_by.h"
#include "reference/forward.h"
#include "reference/reference.h"

namespace mbv {
namespace {

// The base mechanism, or the model loaded again with a witness' own overrides.
Mechanism LoadVariant(const Scenario& scenario, const Mechanism& base, const Overrides& own,
                      const std::string& witness, Diagnostics* diagnostics) {
  if (own.empty()) return base;
  LoadResult loaded = LoadModel(scenario.model_file, ModelOptions(scenario, own));
  if (loaded.mechanism) return *std::move(loaded.mechanism);
  diagnostics->Append(loaded.diagnostics);
  diagnostics->AddError(
      scenario.file,
      fmt::format("the model cannot be loaded with the parameters of the {} witness", witness), "");
  return base;
}

// Why the closed form does not take this mechanism and its loads; "" if it does. One warning each.
std::string Decline(const Scenario& scenario, const Mechanism& mechanism, const ClosedFormRow& row,
                    Diagnostics* diagnostics) {
  if (row.coverage == nullptr) return "";
  const Coverage coverage = row.coverage(mechanism);
  std::vector<Finding> uncovered = FindUncovered(coverage, mechanism, Concern::kDynamics);
  for (Finding& load : FindUncoveredLoads(coverage, mechanism, scenario.motion)) {
    uncovered.push_back(std::move(load));
  }
  const std::string reason = ReasonToDecline(uncovered);
  for (Finding& finding : uncovered) {
    finding.file = scenario.file;
    finding.message = "analytic declines: " + finding.message;
    diagnostics->Add(std::move(finding));
  }
  return reason;
}

}  // namespace

SimulationOptions OptionsOf(const Scenario& scenario, const Mechanism& mechanism, Engine engine) {
  const SimulationSettings& settings = scenario.simulation;
  SimulationOptions options;
  options.mode = settings.forward ? SimulationMode::kForward : SimulationMode::kInverse;
  options.engine = engine;
  options.step_s = settings.step_s;
  if (!settings.forward || engine != Engine::kCorrected) return options;
  if (settings.drive_by == DriveBy::kForces) options.drives = DriveMode::kPushed;
  if (settings.drive_by == DriveBy::kServos) {
    options.drives = DriveMode::kServo;
    options.servo = GainsOf(settings.servo, mechanism);
  }
  return options;
}

WitnessMechanisms LoadWitnessMechanisms(const Scenario& scenario, const Mechanism& base,
                                        Diagnostics* diagnostics) {
  return {LoadVariant(scenario, base, scenario.analytic.parameters, "analytic", diagnostics),
          LoadVariant(scenario, base, scenario.reference.parameters, "reference", diagnostics),
          LoadVariant(scenario, base, scenario.simulation.parameters, "simulated", diagnostics)};
}

ClosedFormChoice MakeClosedForm(const Scenario& scenario, const Mechanism& mechanism,
                                Diagnostics* diagnostics) {
  if (!scenario.analytic.on) return {nullptr, "switched off in the scenario"};
  if (scenario.motion.free()) {
    return {nullptr, "closed forms give forces for a motion, not the motion for forces"};
  }
  const ClosedFormRow* row = FindClosedForm(mechanism.name);
  if (row == nullptr) return {nullptr, "there are no closed-form equations for " + mechanism.name};
  const AnalyticSettings& settings = scenario.analytic;
  bool fits = true;
  if (!settings.model.empty() && !Contains(row->models, settings.model)) {
    diagnostics->AddError(
        scenario.file,
        fmt::format("analytic.model = '{}' is not one of: {}", settings.model, Joined(row->models)),
        "");
    fits = false;
  }
  for (const std::string& erratum : settings.as_printed) {
    if (Contains(row->errata, erratum)) continue;
    diagnostics->AddError(
        scenario.file,
        fmt::format("analytic.as_printed: '{}' is not one of: {}", erratum, Joined(row->errata)),
        "");
    fits = false;
  }
  if (!fits) return {nullptr, "the scenario asks for a formulation that does not exist"};
  if (std::string reason = Decline(scenario, mechanism, *row, diagnostics); !reason.empty()) {
    return {nullptr, std::move(reason)};
  }
  Diagnostics found;
  auto closed_form =
      row->factory(mechanism, scenario.motion,
                   {.model = settings.model, .as_printed = settings.as_printed}, &found);
  for (Finding finding : found.findings()) {
    if (finding.file.empty()) finding.file = scenario.file;
    diagnostics->Add(std::move(finding));
  }
  if (closed_form == nullptr) return {nullptr, "the closed form does not suit this scenario"};
  return {std::move(closed_form), ""};
}

DrivenMotion DriveByClosedForm(const Motion& motion, std::shared_ptr<ClosedForm> closed_form) {
  auto command = std::make_shared<CommandSample>();
  return
      [&motion, command, closed_form = std::move(closed_form)](double t_s, DrivenSample* driven) {
        EvaluateMotion(motion, t_s, command.get());
        return closed_form->Kinematics(*command, driven);
      };
}

DriveForces ForcesByClosedForm(const Motion& motion, std::shared_ptr<ClosedForm> closed_form) {
  auto command = std::make_shared<CommandSample>();
  auto sample = std::make_shared<ClosedFormSample>();
  return [&motion, command, sample, closed_form = std::move(closed_form)](double t_s, VecX* force) {
    EvaluateMotion(motion, t_s, command.get());
    RunSummary summary = closed_form->Dynamics(*command, sample.get());
    if (summary.ok()) *force = sample->force;
    return summary;
  };
}

DrivenMotion DriveByCommands(const Mechanism& mechanism, const Motion& motion) {
  const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
  const auto all = drives + static_cast<Eigen::Index>(mechanism.prescribed.size());
  return [&motion, drives, all](double t_s, DrivenSample* driven) {
    for (VecX* x : {&driven->position, &driven->velocity, &driven->acceleration}) x->setZero(all);
    for (const Command& command : motion.commands) {
      const Coordinate& c = command.terms.front().coordinate;
      MBV_DEMAND(c.kind != Coordinate::Kind::kOutput, command.name);
      const auto k = c.index + (c.kind == Coordinate::Kind::kDrive ? 0 : drives);
      const Jet jet = Evaluate(command.profile, t_s);
      driven->position[k] = jet.value;
      driven->velocity[k] = jet.rate;
      driven->acceleration[k] = jet.acceleration;
    }
    return RunSummary::Done();
  };
}

namespace {

struct ReferenceState {
  ReferenceSolver solver;
  CommandSample command;
  ReferenceSample sample;
};

}  // namespace

DriveForces ForcesByReference(const Mechanism& mechanism, const Motion& motion) {
  auto state =
      std::make_shared<ReferenceState>(ReferenceState{ReferenceSolver(mechanism, motion), {}, {}});
  return [&motion, state](double t_s, VecX* force) {
    EvaluateMotion(motion, t_s, &state->command);
    RunSummary summary = state->solver.Dynamics(state->command, &state->sample);
    if (summary.ok()) *force = state->sample.drive_force;
    return summary;
  };
}

DrivenMotion DriveByReference(const Mechanism& mechanism, const Motion& motion) {
  auto state =
      std::make_shared<ReferenceState>(ReferenceState{ReferenceSolver(mechanism, motion), {}, {}});
  return [&motion, state](double t_s, DrivenSample* driven) {
    EvaluateMotion(motion, t_s, &state->command);
    RunSummary summary = state->solver.Kinematics(state->command, &state->sample);
    if (summary.ok()) *driven = state->sample.driven;
    return summary;
  };
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
    } else if (channel.name.starts_with("closure.")) {
      const auto worse = [](double x, double y) { return std::isnan(x) || x > y ? x : y; };
      trace.values.col(column) =
          a.values.col(column).cwiseAbs().binaryExpr(b.values.col(column).cwiseAbs(), worse);
    }
  }
  return trace;
}

SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                               const DrivenMotion& driven, Engine engine,
                               const std::function<void(double)>& progress) {
  return RunSimulation(scenario, mechanism, driven, OptionsOf(scenario, mechanism, engine),
                       progress);
}

SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                               const DrivenMotion& driven, const SimulationOptions& options,
                               const std::function<void(double)>& progress) {
  SimulatedWitness witness;
  const Diagnostics option_findings = Check(options);
  for (const Finding& finding : option_findings.findings()) {
    witness.diagnostics.AddError(scenario.file, "simulation: " + finding.message, finding.hint);
  }
  if (witness.diagnostics.has_errors()) return witness;
  if (!scenario.simulation.extrapolate) {
    SimulationOptions started = options;
    if (scenario.motion.free()) {
      witness.run.summary = InitialStates(mechanism, scenario.motion, &started.start);
      if (!witness.run.summary.ok()) return witness;
    }
    witness.run = Simulate(mechanism, scenario.motion, driven, started, progress);
    return witness;
  }
  MBV_DEMAND(!scenario.motion.free(), scenario.name);  // forces are not linear in it
  const Extrapolation& extrapolation = *scenario.simulation.extrapolate;
  const Overrides base = Merge(scenario.parameters, scenario.simulation.parameters);
  std::array<SimulationRun, 2> runs;
  for (size_t k = 0; k < 2; ++k) {
    const Mechanism variant = LoadVariant(
        scenario, mechanism, Merge(base, {{extrapolation.parameter, extrapolation.from[k]}}),
        "simulated", &witness.diagnostics);
    if (witness.diagnostics.has_errors()) return witness;
    const auto half = [&](double fraction) {
      if (progress) progress(0.5 * (static_cast<double>(k) + fraction));
    };
    runs[k] = Simulate(variant, scenario.motion, driven, options, half);
    if (!runs[k].summary.ok()) {
      witness.run = std::move(runs[k]);
      return witness;
    }
  }
  const double target = mechanism.ParameterValue(extrapolation.parameter);
  const Trace trace = Extrapolate(runs[0].trace, extrapolation.from[0], runs[1].trace,
                                  extrapolation.from[1], target);
  witness.run = std::move(runs[0]);
  witness.run.trace = trace;
  witness.run.steps += runs[1].steps;
  witness.run.loop_wall_s += runs[1].loop_wall_s;
  witness.run.loop_cpu_s += runs[1].loop_cpu_s;
  witness.run.summary.wall_s += runs[1].summary.wall_s;
  return witness;
}

}  // namespace mbv
