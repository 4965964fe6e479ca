#include "reference/forward.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/demand.h"
#include "base/roles.h"
#include "math/spatial.h"
#include "mechanism/channels.h"
#include "mechanism/motion.h"
#include "reference/closure_solver.h"
#include "reference/free_motion.h"
#include "reference/sample_recorder.h"

namespace mbv {
namespace {

using internal::Effort;
using internal::FreeMotion;

// The disturbance of the start for ForwardRun::growth [rad, characteristic lengths]: far above the
// integration error, far below the mechanism.
constexpr double kDisturbance = 1e-7;
constexpr double kLooser = 100.0;  // times the tolerance
// The three integrations of a run with measured trust, in their order.
enum class Pass { kMain, kLooser, kDisturbed };

Effort EffortOf(const ForwardOptions& options, size_t samples, Pass pass) {
  const long most = 4 * static_cast<long>(samples) + options.spare_steps;
  Effort effort{.most_steps = pass == Pass::kMain ? most : 2 * most};
  if (!options.progress) return effort;
  const double parts = options.measure_trust ? 3.0 : 1.0;
  effort.progress = [report = options.progress, parts, pass](double fraction) {
    report((static_cast<double>(pass) + fraction) / parts);
  };
  return effort;
}

// Distance of two sets of poses [rad, characteristic lengths].
double Distance(const BodyStates& a, const BodyStates& b, double length) {
  double sum = 0.0;
  for (size_t i = 1; i < a.X_WB.size(); ++i) {
    const Mat3 R = a.X_WB[i].linear().transpose() * b.X_WB[i].linear();
    sum += LogRotation(R).squaredNorm() +
           (a.X_WB[i].translation() - b.X_WB[i].translation()).squaredNorm() / (length * length);
  }
  return std::sqrt(sum);
}

double LargestDifference(const BodyStates& a, const BodyStates& b, double length) {
  double largest = 0.0;
  for (size_t i = 1; i < a.X_WB.size(); ++i) {
    const Mat3 R = a.X_WB[i].linear().transpose() * b.X_WB[i].linear();
    largest = std::max({largest, LogRotation(R).norm(),
                        (a.X_WB[i].translation() - b.X_WB[i].translation()).norm() / length});
  }
  return largest;
}

// Integrates once more from `start` and calls `compare` at every sample; the steps it took, or none
// if it fails.
template <typename Compare>
std::optional<long> Repeat(const Mechanism& mechanism, const Motion& motion,
                           const std::vector<double>& times, const BodyStates& start,
                           double tolerance, double largest_step_s, Effort effort,
                           const Compare& compare) {
  FreeMotion again(mechanism, motion, tolerance, largest_step_s, std::move(effort));
  if (!again.Start(start).ok()) return {};
  compare(0, again.states());
  for (size_t i = 1; i < times.size(); ++i) {
    if (!again.AdvanceTo(times[i]).ok()) return {};
    compare(i, again.states());
  }
  return again.steps();
}

void MeasureUncertainty(const Mechanism& mechanism, const Motion& motion,
                        const ForwardOptions& options, const std::vector<BodyStates>& samples,
                        double length, ForwardRun* run) {
  double difference = 0.0;
  const auto repeat = [&](double tolerance, double largest_step_s) {
    return Repeat(
        mechanism, motion, run->trace.time_s, run->start, tolerance, largest_step_s,
        EffortOf(options, samples.size(), Pass::kLooser), [&](size_t i, const BodyStates& states) {
          difference = std::max(difference, LargestDifference(states, samples[i], length));
        });
  };
  std::optional<long> steps = repeat(kLooser * options.tolerance, motion.sample_s);
  // Where the samples alone set the steps, the tolerance changes nothing; shorter steps do.
  if (steps == run->steps) steps = repeat(options.tolerance, 0.5 * motion.sample_s);
  if (steps) run->uncertainty = std::max(difference, kEps);
}

void MeasureTrust(const Mechanism& mechanism, const Motion& motion, const ForwardOptions& options,
                  const std::vector<BodyStates>& samples, ForwardRun* run) {
  internal::FreeDynamics dynamics(mechanism, motion);
  const double length = dynamics.length();
  MeasureUncertainty(mechanism, motion, options, samples, length, run);

  BodyStates disturbed = run->start;
  dynamics.Factor(0.0, disturbed);
  const MatX R = dynamics.Motions();
  VecX step = R * VecX::Ones(R.cols());
  VecX size = step;
  for (Eigen::Index k = 0; k < size.size(); k += 6) size.segment<3>(k + 3) /= length;
  step *= kDisturbance / size.norm();
  internal::MoveBodies(step, &disturbed);
  double at_start = kNan, growth = 0.0;
  const std::optional<long> moved = Repeat(
      mechanism, motion, run->trace.time_s, disturbed, options.tolerance, motion.sample_s,
      EffortOf(options, samples.size(), Pass::kDisturbed), [&](size_t i, const BodyStates& states) {
        const double distance = Distance(states, samples[i], length);
        if (i == 0) at_start = distance;
        growth = std::max(growth, distance / at_start);
      });
  if (moved) run->growth = growth;
}

// Everything a sample records, from states with accelerations.
void Complete(double t_s, FreeMotion* free, internal::SampleRecorder* recorder,
              ReferenceSample* sample) {
  sample->states = free->states();
  sample->work = free->work();
  free->dynamics().Gaps(sample->states, &sample->closure_position_m, &sample->closure_rotation_rad);
  recorder->Record(sample);
  free->dynamics().Forces(t_s, sample);
}

RunSummary Integrate(const Mechanism& mechanism, const Motion& motion,
                     const ForwardOptions& options, ForwardRun* run) {
  if (RunSummary summary = InitialStates(mechanism, motion, &run->start); !summary.ok()) {
    return summary;
  }
  FreeMotion free(mechanism, motion, options.tolerance, motion.sample_s,
                  EffortOf(options, run->trace.time_s.size(), Pass::kMain));
  if (RunSummary summary = free.Start(run->start); !summary.ok()) return summary;
  internal::SampleRecorder recorder(mechanism);
  ReferenceSample sample;
  std::vector<BodyStates> samples;
  const ChannelColumns columns(run->trace.channels);
  Eigen::RowVectorXd row = Eigen::RowVectorXd::Constant(run->trace.values.cols(), kNan);
  RunSummary summary = RunSummary::Done();
  for (size_t i = 0; i < run->trace.time_s.size() && summary.ok(); ++i) {
    const double t_s = run->trace.time_s[i];
    if (i > 0) summary = free.AdvanceTo(t_s);
    if (!summary.ok()) break;
    Complete(t_s, &free, &recorder, &sample);
    internal::WriteSample(mechanism, sample, columns, row);
    run->trace.values.row(static_cast<Eigen::Index>(i)) = row;
    samples.push_back(sample.states);
  }
  run->steps = free.steps();
  run->evaluations = free.evaluations();
  run->singular = free.Crossings();
  run->trace.events = free.events();
  if (summary.ok() && options.measure_trust) {
    MeasureTrust(mechanism, motion, options, samples, run);
  }
  return summary;
}

}  // namespace

RunSummary InitialStates(const Mechanism& mechanism, const Motion& motion, BodyStates* states) {
  Motion start = motion;
  start.initial.clear();
  start.forces.clear();
  for (const InitialValue& value : motion.initial) {
    start.commands.push_back({.name = value.name,
                              .terms = {{value.coordinate, 1.0}},
                              .profile = {{ConstantTerm{value.position}, RampTerm{value.rate}}}});
  }
  ReferenceSolver solver(mechanism, start);
  CommandSample command;
  EvaluateMotion(start, 0.0, &command);
  ReferenceSample sample;
  RunSummary summary = solver.Kinematics(command, &sample);
  if (summary.ok()) {
    *states = sample.states;
  } else {
    summary.message = "initial state: " + summary.message;
  }
  return summary;
}

ForwardRun RunForwardReference(const Mechanism& mechanism, const Motion& motion,
                               const ForwardOptions& options) {
  MBV_DEMAND(motion.free(), motion.commands.size());
  MBV_DEMAND(options.tolerance > 0.0, options.tolerance);
  const ComputingTime time;
  ForwardRun run;
  run.trace.witness = role::kReference.name;
  std::vector<Channel> channels = internal::ReferenceChannels(mechanism, motion, options.reactions);
  for (Channel& channel : WorkChannels(mechanism)) channels.push_back(std::move(channel));
  run.trace.Reset(SampleTimes(motion.duration_s, motion.sample_s), std::move(channels));
  run.summary = Integrate(mechanism, motion, options, &run);
  time.StopInto(&run.summary);
  return run;
}

}  // namespace mbv
