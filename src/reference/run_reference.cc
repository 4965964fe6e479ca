#include <chrono>

#include "core/roles.h"
#include "reference/reference.h"
#include "reference/sample_recorder.h"

namespace mbv {

ReferenceRun RunReference(const Mechanism& mechanism, const Motion& motion,
                          const ReferenceOptions& options,
                          const std::function<void(size_t i, CommandSample* command)>& commands) {
  const auto start = std::chrono::steady_clock::now();
  ReferenceRun run;
  run.trace.witness = role::kReference.name;
  run.trace.Reset(SampleTimes(motion.duration_s, motion.sample_s),
                  internal::ReferenceChannels(mechanism, options.reactions));
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
    internal::WriteSample(sample, columns, row);
    run.trace.values.row(static_cast<Eigen::Index>(i)) = row;
  }
  run.summary.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

}  // namespace mbv
