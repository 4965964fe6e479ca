#include "pipeline/drive_sources.h"

#include "core/demand.h"
#include "reference/reference.h"

namespace mbv {

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

}  // namespace mbv
