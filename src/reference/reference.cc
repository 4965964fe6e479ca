#include "reference/reference.h"

#include "base/roles.h"
#include "reference/closure_solver.h"
#include "reference/force_solver.h"
#include "reference/sample_recorder.h"

namespace mbv {

struct ReferenceSolver::Impl {
  Impl(const Mechanism& m, const Motion& motion, const ReferenceOptions& options)
      : mechanism(m),
        closure(m, motion, options),
        forces(m, motion.duration_s),
        recorder(m, motion.RecordedJoints()) {}

  const Mechanism& mechanism;
  internal::ClosureSolver closure;
  internal::ForceSolver forces;
  internal::SampleRecorder recorder;
};

ReferenceSolver::ReferenceSolver(const Mechanism& mechanism, const Motion& motion,
                                 const ReferenceOptions& options)
    : impl_(std::make_unique<Impl>(mechanism, motion, options)) {}
ReferenceSolver::~ReferenceSolver() = default;
ReferenceSolver::ReferenceSolver(ReferenceSolver&&) noexcept = default;

RunSummary ReferenceSolver::Kinematics(const CommandSample& command, ReferenceSample* sample) {
  if (RunSummary summary = impl_->closure.Solve(command); !summary.ok()) return summary;
  sample->states = impl_->closure.states();
  sample->closure_position_m = impl_->closure.gap_position_m();
  sample->closure_rotation_rad = impl_->closure.gap_rotation_rad();
  sample->control = impl_->closure.control();
  impl_->recorder.Record(sample);
  return RunSummary::Done();
}

RunSummary ReferenceSolver::Dynamics(const CommandSample& command, ReferenceSample* sample) {
  if (RunSummary summary = Kinematics(command, sample); !summary.ok()) return summary;
  sample->states.engaged = command.engaged;
  sample->states.carried = command.carried;
  RunSummary summary = impl_->forces.Solve(command.loads, sample, &impl_->closure);
  if (!summary.ok()) {
    summary.time_s = command.time_s;
    return summary;
  }
  internal::AuditSample(impl_->mechanism, command.loads, sample);
  return summary;
}

ReferenceRun RunReference(const Mechanism& mechanism, const Motion& motion,
                          const ReferenceOptions& options,
                          const std::function<void(size_t i, CommandSample* command)>& commands,
                          Trace reuse) {
  const ComputingTime time;
  ReferenceRun run{.trace = std::move(reuse), .summary = {}};
  run.trace.witness = role::kReference.name;
  run.trace.events.clear();
  std::vector<Channel> channels =
      run.trace.channels.empty() ? internal::ReferenceChannels(mechanism, motion, options.reactions)
                                 : std::move(run.trace.channels);
  run.trace.Reset(SampleTimes(motion.duration_s, motion.sample_s), std::move(channels));
  ReferenceSolver solver(mechanism, motion, options);
  CommandSample command;
  ReferenceSample sample;
  const ChannelColumns columns(run.trace.channels);
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Constant(run.trace.values.cols(), kNan);
  run.summary = RunSummary::Done();
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    EvaluateMotion(motion, run.trace.time_s[i], &command);
    if (commands) commands(i, &command);
    run.summary = solver.Dynamics(command, &sample);
    if (!run.summary.ok()) break;
    internal::WriteSample(mechanism, sample, columns, row);
    run.trace.values.row(static_cast<Eigen::Index>(i)) = row;
  }
  time.StopInto(&run.summary);
  return run;
}

}  // namespace mbv
