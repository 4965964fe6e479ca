// What the witnesses answer at one state.
#include <algorithm>
#include <cmath>

#include "base/demand.h"
#include "kinematics/constraints.h"
#include "mechanism/channels.h"
#include "tests/laws/subject.h"

namespace mbv::laws {

Answer ByClosedForm(const Subject& subject, const CommandSample& command) {
  Answer answer;
  ClosedFormSample sample;
  answer.summary = subject.MakeClosedForm()->Dynamics(command, &sample);
  answer.driven = sample.driven;
  answer.force = sample.force;
  answer.extra = sample.extra;
  return answer;
}

Answer Ask(ReferenceSolver* solver, const CommandSample& command) {
  Answer answer;
  ReferenceSample sample;
  answer.summary = solver->Dynamics(command, &sample);
  answer.driven = sample.driven;
  answer.force = sample.drive_force;
  answer.prescribed_force = sample.prescribed_force;
  answer.states = sample.states;
  answer.power_input_W = sample.power.input;
  answer.energy_rate_W = sample.power.energy_rate;
  return answer;
}

Answer ByReference(const Subject& subject, const CommandSample& command) {
  ReferenceSolver solver(subject.mechanism, subject.motion);
  return Ask(&solver, command);
}

Answer BySimulation(const Subject& subject, const DrivenSample& driven,
                    const CommandSample& command) {
  Motion motion = subject.motion;
  std::vector<DrivenSample> samples = WayTo(subject, command);
  samples.push_back(driven);
  motion.sample_s = 1e-6;  // too short for the last sample's speed to lead Newton astray
  motion.duration_s = motion.sample_s * static_cast<double>(samples.size() - 1);
  for (size_t k = 0; k < motion.loads.size(); ++k) {
    for (int j = 0; j < 3; ++j) {
      motion.loads[k].force[j] = Constant(command.loads[k].force[j]);
      motion.loads[k].moment[j] = Constant(command.loads[k].moment[j]);
    }
  }
  const SimulationRun run = Simulate(subject.mechanism, motion,
                                     [&](double, DrivenSample* out) {
                                       *out = driven;
                                       return RunSummary::Done();
                                     },
                                     {.mode = DriveMode::kInverse});
  Answer answer;
  answer.summary = run.summary;
  if (!run.summary.ok()) return answer;
  answer.driven = driven;
  const auto at = [&](const std::string& channel) {
    const int column = run.trace.Find(channel);
    return column < 0 ? kNan : run.trace.values(run.trace.values.rows() - 1, column);
  };
  const Mechanism& m = subject.mechanism;
  answer.force.resize(static_cast<Eigen::Index>(m.drives.size()));
  for (size_t d = 0; d < m.drives.size(); ++d) {
    answer.force[static_cast<Eigen::Index>(d)] = at(m.drives[d].name + ".force");
  }
  answer.prescribed_force.resize(static_cast<Eigen::Index>(m.prescribed.size()));
  for (size_t p = 0; p < m.prescribed.size(); ++p) {
    answer.prescribed_force[static_cast<Eigen::Index>(p)] = at(m.prescribed[p].name + ".force");
  }
  answer.states.Resize(m.bodies.size());
  answer.states.X_WB = run.X_WB.back();
  answer.power_input_W = at("power.input");
  answer.energy_rate_W = at("power.energy_rate");
  return answer;
}

CommandSample CommandsAt(const Subject& subject, const BodyStates& states,
                         const CommandSample& near) {
  CommandSample c = near;
  for (size_t k = 0; k < subject.motion.commands.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    c.position[i] = c.velocity[i] = c.acceleration[i] = 0.0;
    const Command& command = subject.motion.commands[k];
    for (const Command::Term& term : command.terms) {
      const double expected = command.terms.size() == 1 ? near.position[i] : 0.0;
      const ScalarRow row = CoordinateRow(subject.mechanism, term.coordinate, states, expected);
      const auto along = [&](const std::vector<Vec6>& rate) {
        return row.J_parent.dot(rate[row.parent]) + row.J_child.dot(rate[row.child]);
      };
      c.position[i] += term.factor * row.value;
      c.velocity[i] += term.factor * along(states.V_WB);
      c.acceleration[i] += term.factor * (along(states.A_WB) + row.bias);
    }
  }
  return c;
}

std::vector<DrivenSample> WayTo(const Subject& subject, const CommandSample& command) {
  constexpr int kSteps = 16;
  CommandSample first;
  EvaluateMotion(subject.motion, 0.0, &first);
  const auto form = subject.MakeClosedForm();
  std::vector<DrivenSample> way;
  for (int i = 0; i < kSteps; ++i) {
    CommandSample c = Displaced(first, 0, 0.0);
    c.position += (command.position - first.position) * i / kSteps;
    DrivenSample driven;
    if (form->Kinematics(c, &driven).ok()) way.push_back(std::move(driven));
  }
  return way;
}

CommandSample DriveCommand(const DrivenSample& driven, const CommandSample& loads) {
  CommandSample c;
  c.time_s = loads.time_s;
  c.position = driven.position;
  c.velocity = driven.velocity;
  c.acceleration = driven.acceleration;
  c.loads = loads.loads;
  return c;
}

MatX DriveJacobian(const Subject& subject, const CommandSample& at) {
  const auto commands = static_cast<Eigen::Index>(subject.motion.commands.size());
  const auto driven = static_cast<Eigen::Index>(subject.mechanism.drives.size() +
                                                subject.mechanism.prescribed.size());
  MatX J(driven, commands);
  CommandSample c = at;
  c.acceleration.setZero();
  const auto form = subject.MakeClosedForm();
  for (Eigen::Index k = 0; k < commands; ++k) {
    c.velocity.setZero();
    J.col(k).setZero();
    if (subject.IsHeld(static_cast<size_t>(k))) continue;
    c.velocity[k] = 1.0;
    DrivenSample sample;
    J.col(k).setConstant(kNan);
    if (form->Kinematics(c, &sample).ok()) J.col(k) = sample.velocity;
  }
  return J;
}

}  // namespace mbv::laws
