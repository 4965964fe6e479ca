#include "analytic/closed_form.h"

#include "base/roles.h"
#include "mechanism/channels.h"

namespace mbv {

namespace {

std::vector<Channel> ChannelsOf(const Mechanism& mechanism, const ClosedForm& closed_form) {
  std::vector<Channel> channels = DriveChannels(mechanism);
  if (!closed_form.gives_forces()) {
    std::erase_if(channels, [](const Channel& c) { return c.quantity == Quantity::kForce; });
  }
  for (Channel& channel : closed_form.extra_channels()) channels.push_back(std::move(channel));
  return channels;
}

}  // namespace

ClosedFormRun RunClosedForm(const Mechanism& mechanism, const Motion& motion,
                            ClosedForm* closed_form, Trace reuse) {
  ClosedFormRun run{.trace = std::move(reuse), .summary = {}};
  const bool forces = closed_form->gives_forces();
  std::vector<Channel> channels = run.trace.channels.empty() ? ChannelsOf(mechanism, *closed_form)
                                                             : std::move(run.trace.channels);
  run.trace.witness = role::kAnalytic.name;
  run.trace.events.clear();
  run.trace.Reset(SampleTimes(motion.duration_s, motion.sample_s), std::move(channels));

  const ComputingTime time;
  CommandSample command;
  ClosedFormSample sample;
  const ChannelColumns columns(run.trace.channels);
  run.summary = RunSummary::Done();
  for (size_t i = 0; i < run.trace.time_s.size() && run.summary.ok(); ++i) {
    EvaluateMotion(motion, run.trace.time_s[i], &command);
    run.summary = closed_form->Dynamics(command, &sample);
    if (!run.summary.ok()) break;
    auto row = run.trace.values.row(static_cast<Eigen::Index>(i));
    for (size_t d = 0; d < mechanism.drives.size(); ++d) {
      const auto k = static_cast<Eigen::Index>(d);
      row[columns(Quantity::kPosition, d)] = sample.driven.position[k];
      row[columns(Quantity::kVelocity, d)] = sample.driven.velocity[k];
      row[columns(Quantity::kAcceleration, d)] = sample.driven.acceleration[k];
      if (forces) row[columns(Quantity::kForce, d)] = sample.force[k];
    }
    row.tail(sample.extra.size()) = sample.extra.transpose();
  }
  time.StopInto(&run.summary);
  return run;
}

}  // namespace mbv
