#include <chrono>

#include "core/demand.h"
#include "mechanism/channels.h"
#include "reference/reference.h"

namespace mbv {
namespace {

std::vector<Channel> ReferenceChannels(const Mechanism& mechanism, bool reactions) {
  std::vector<Channel> channels = DriveChannels(mechanism);
  const auto append = [&](std::vector<Channel> more) {
    channels.insert(channels.end(), more.begin(), more.end());
  };
  append(OutputChannels(mechanism));
  append(PrescribedChannels(mechanism));
  if (reactions) {
    for (const Joint& joint : mechanism.joints) append(ReactionChannels(joint));
  }
  append(AuditChannels());
  return channels;
}

// Writes one sample in the order of ReferenceChannels().
void Record(const ReferenceSample& sample, bool reactions, Eigen::Ref<Eigen::RowVectorXd> row) {
  Eigen::Index at = 0;
  const auto put = [&](double value) { row[at++] = value; };
  for (Eigen::Index d = 0; d < sample.drive_force.size(); ++d) {
    put(sample.driven.position[d]);
    put(sample.driven.velocity[d]);
    put(sample.driven.acceleration[d]);
    put(sample.drive_force[d]);
  }
  const auto put_rows = [&](const MatX& table) {
    for (Eigen::Index i = 0; i < table.rows(); ++i) {
      for (Eigen::Index c = 0; c < table.cols(); ++c) put(table(i, c));
    }
  };
  put_rows(sample.outputs);
  for (Eigen::Index p = 0; p < sample.prescribed_force.size(); ++p) {
    put(sample.prescribed_force[p]);
  }
  if (reactions) put_rows(sample.reactions);
  put(sample.closure_position_m);
  put(sample.closure_rotation_rad);
  put(sample.power_input_W);
  put(sample.energy_rate_W);
  MBV_DEMAND(at == row.size(), at);
}

}  // namespace

ReferenceRun RunReference(const Mechanism& mechanism, const Motion& motion,
                          const ReferenceOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  ReferenceRun run;
  run.trace.witness = "reference";
  run.trace.Reset(SampleTimes(motion.duration_s, motion.sample_s),
                  ReferenceChannels(mechanism, options.reactions));
  ReferenceSolver solver(mechanism, motion, options);
  CommandSample command;
  ReferenceSample sample;
  run.summary = RunSummary::Done();
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    EvaluateMotion(motion, run.trace.time_s[i], &command);
    run.summary = solver.Dynamics(command, &sample);
    if (!run.summary.ok()) break;
    Eigen::RowVectorXd row(run.trace.values.cols());
    Record(sample, options.reactions, row);
    run.trace.values.row(static_cast<Eigen::Index>(i)) = row;
  }
  run.summary.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

}  // namespace mbv
