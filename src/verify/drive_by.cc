#include "verify/drive_by.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "base/demand.h"
#include "reference/reference.h"

namespace mbv {
namespace {

// Every drive by itself, and the commands of prescribed joints.
Motion CommandDrives(const Mechanism& mechanism, const Motion& motion) {
  Motion drives = motion;
  drives.commands.clear();
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    Command command;
    command.name = mechanism.drives[d].name;
    command.terms.push_back(
        {.coordinate = {.kind = Coordinate::Kind::kDrive, .index = static_cast<int>(d)}});
    drives.commands.push_back(std::move(command));
  }
  for (const Command& command : motion.commands) {
    const bool base = std::all_of(command.terms.begin(), command.terms.end(), [](const auto& term) {
      return term.coordinate.kind == Coordinate::Kind::kPrescribed;
    });
    if (base) drives.commands.push_back(command);
  }
  return drives;
}

std::string GainText(const Gain& gain) {
  if (gain.all) return fmt::format("{:g}", *gain.all);
  double least = kNan, most = kNan;
  for (const auto& [name, value] : gain.by_drive) {
    least = std::fmin(least, value);
    most = std::fmax(most, value);
  }
  return fmt::format("{:g} … {:g}", least, most);
}

}  // namespace

ReferenceRun RunReached(const Mechanism& mechanism, const Motion& motion, const Trace& simulated) {
  const Motion drives = CommandDrives(mechanism, motion);
  const ChannelColumns columns(simulated.channels);
  const auto commands = [&](size_t i, CommandSample* command) {
    for (size_t d = 0; d < mechanism.drives.size(); ++d) {
      const auto row = static_cast<Eigen::Index>(i), k = static_cast<Eigen::Index>(d);
      command->position[k] = simulated.values(row, columns(Quantity::kPosition, d));
      command->velocity[k] = simulated.values(row, columns(Quantity::kVelocity, d));
      command->acceleration[k] = simulated.values(row, columns(Quantity::kAcceleration, d));
    }
  };
  ReferenceRun run = RunReference(mechanism, drives, {}, commands);
  run.trace.witness = role::kReached.name;
  return run;
}

DriveForces PerturbedForces(const DriveForces& forces, const Mechanism& mechanism,
                            const Trace& truth, double perturbation) {
  std::map<std::string, std::pair<double, double>> square;  // per unit: sum and count
  for (const Drive& drive : mechanism.drives) {
    const int column = truth.Find(Quantity::kForce, drive.name);
    MBV_DEMAND(column >= 0, drive.name);
    auto& [sum, count] = square[ForceUnit(mechanism, drive)];
    sum += truth.values.col(column).squaredNorm();
    count += static_cast<double>(truth.values.rows());
  }
  VecX offset(static_cast<Eigen::Index>(mechanism.drives.size()));
  for (Eigen::Index d = 0; d < offset.size(); ++d) {
    const auto& [sum, count] =
        square[ForceUnit(mechanism, mechanism.drives[static_cast<size_t>(d)])];
    offset[d] = (d % 2 == 0 ? perturbation : -perturbation) * std::sqrt(sum / count);
  }
  return [forces, offset](double t_s, VecX* force) {
    RunSummary summary = forces(t_s, force);
    if (summary.ok()) *force += offset;
    return summary;
  };
}

ServoGains GainsOf(const ServoSettings& settings, const Mechanism& mechanism) {
  const auto drives = static_cast<Eigen::Index>(mechanism.drives.size());
  ServoGains gains{.kp = VecX(drives), .kv = VecX(drives)};
  for (Eigen::Index d = 0; d < drives; ++d) {
    const std::string& name = mechanism.drives[static_cast<size_t>(d)].name;
    gains.kp[d] = settings.kp.Of(name);
    gains.kv[d] = settings.kv.Of(name);
  }
  return gains;
}

const char* ModeText(const SimulationSettings& settings) {
  if (!settings.on) return "off";
  switch (settings.mode) {
    case DriveMode::kInverse:
      return "inverse";
    case DriveMode::kPrescribedMotion:
      return "forward";
    case DriveMode::kForceDriven:
      return "force_driven";
    case DriveMode::kServo:
      return "servo";
  }
  return "";
}

std::string DriveText(const SimulationSettings& settings, const std::string& driven_by) {
  switch (settings.mode) {
    case DriveMode::kInverse:
    case DriveMode::kPrescribedMotion:
      return driven_by + " drive motion";
    case DriveMode::kForceDriven:
      return "driven in open loop by the " + driven_by + " drive forces";
    case DriveMode::kServo:
      return fmt::format("servos on the {} drive motion, kp {}, kv {}, feed-forward: {}", driven_by,
                         GainText(settings.servo.kp), GainText(settings.servo.kv),
                         settings.servo.feedforward ? "its forces" : "none");
  }
  return "";
}

std::string SimulationLine(const Prepared& prepared) {
  const Scenario& scenario = prepared.scenario;
  const SimulationSettings& simulation = scenario.simulation;
  if (!simulation.on) return "no simulation";
  std::string line =
      simulation.forward()
          ? fmt::format("forward simulation, step {:g} ms, {} engine", 1e3 * simulation.step_s,
                        simulation.stock_engine ? "stock" : "corrected")
          : std::string("inverse dynamics at each sample");
  const std::string drives = DriveText(simulation, prepared.driver().name);
  line +=
      fmt::format(", {}, {:g} s sampled every {:g} ms",
                  scenario.motion.free() ? FreeMotionText(prepared.base, scenario.motion) : drives,
                  scenario.phase ? scenario.phase->end_s : scenario.motion.duration_s,
                  1e3 * scenario.motion.sample_s);
  if (scenario.phase) line += fmt::format(", in {} phases", scenario.phase->count);
  if (simulation.extrapolate) {
    const Extrapolation& extrapolation = *simulation.extrapolate;
    line += fmt::format("; forces extrapolated in {} from {:g} and {:g} to {:g}",
                        extrapolation.parameter, extrapolation.from[0], extrapolation.from[1],
                        prepared.mechanisms.simulated.ParameterValue(extrapolation.parameter));
  }
  if (prepared.has_closed_form() && !scenario.analytic.equations.empty()) {
    line += fmt::format("; analytic: the equations of {}",
                        std::filesystem::path(scenario.analytic.equations).filename().string());
  }
  return line;
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

// A solver with what it computes.
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

std::string FreeMotionText(const Mechanism& mechanism, const Motion& motion) {
  constexpr size_t kMost = 4;
  std::string start;
  for (size_t i = 0; i < motion.initial.size() && i < kMost; ++i) {
    const InitialValue& value = motion.initial[i];
    start += fmt::format("{}{} = {:.6g}", i == 0 ? "" : ", ", value.name, value.position);
    if (value.rate != 0.0) start += fmt::format(" (rate {:.6g})", value.rate);
  }
  if (motion.initial.size() > kMost) start += ", …";
  std::string text =
      fmt::format("free motion of {} {} from {}", motion.initial.size(),
                  motion.initial.size() == 1 ? "degree of freedom" : "degrees of freedom", start);
  for (size_t i = 0; i < motion.forces.size(); ++i) {
    text += (i == 0 ? ", forces given for " : ", ") +
            mechanism.drives[static_cast<size_t>(motion.forces[i].drive)].name;
  }
  return text;
}

std::string TrustLine(const ForwardRun& run) {
  if (std::isnan(run.uncertainty) || std::isnan(run.growth)) {
    return fmt::format("reference integrated in {} steps", run.steps);
  }
  return fmt::format(
      "reference integrated in {} steps to {:.1e} [rad, characteristic lengths]; a difference of "
      "the start grows up to {:.3g} times",
      run.steps, run.uncertainty, run.growth);
}

std::vector<std::string> CrossingTexts(const ForwardRun& run, double duration_s) {
  constexpr size_t kMost = 5;
  std::vector<std::string> texts;
  for (const SingularityCrossing& crossing : run.singular) {
    if (texts.size() == kMost) {
      texts.push_back(fmt::format("… and {} more singular poses within {:g} s",
                                  run.singular.size() - kMost, duration_s));
      break;
    }
    texts.push_back(fmt::format(
        "the motion {} a singular pose at t = {:.6g} s: the loops lose a constraint there, {} "
        "could move by itself (weakest constraint {:.1e} of its usual size); the motion is "
        "continued smoothly, reactions near it are large and uncertain",
        crossing.passed ? "passes" : "comes close to", crossing.time_s, crossing.joint,
        crossing.pivot));
  }
  return texts;
}

}  // namespace mbv
