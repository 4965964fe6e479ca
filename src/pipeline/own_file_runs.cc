#include "pipeline/own_file_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/comparison.h"
#include "comparison/metric_value.h"
#include "core/files.h"
#include "core/in_children.h"
#include "core/text.h"
#include "mechanism/reach.h"
#include "pipeline/own_run_bytes.h"
#include "pipeline/run_witnesses.h"

namespace mbv {
namespace {

constexpr double kTimeout_s = 30.0;  // of one run

}  // namespace

OwnFileRuns::OwnFileRuns(const OwnFileRequest& request)
    : request_(request), prepared_(*request.prepared), motion_(prepared_.scenario.motion) {
  length_m_ = CharacteristicLength(prepared_.base);
  task_.file = request.file;
  task_.text = request.text.empty() ? ReadWholeFile(request.file).value_or("") : request.text;
  task_.mechanism = &prepared_.base;
  task_.duration_s = motion_.duration_s;
  task_.sample_s = motion_.sample_s;
  task_.ignore_ranges = prepared_.scenario.simulation.ignore_ranges;
  FindCommands();
  twists_ = TwistsOfDriven(prepared_.base, std::vector<bool>(prepared_.base.drives.size(), true));
}

// The motion of each drive is its command; nothing else is commanded.
void OwnFileRuns::FindCommands() {
  const Motion& motion = prepared_.scenario.motion;
  constexpr size_t kNone = static_cast<size_t>(-1);
  command_of_.assign(prepared_.base.drives.size(), kNone);
  bool plain = !motion.free() && motion.loads.empty() && prepared_.base.prescribed.empty() &&
               motion.commands.size() == command_of_.size();
  for (size_t c = 0; plain && c < motion.commands.size(); ++c) {
    const std::vector<Command::Term>& terms = motion.commands[c].terms;
    plain = terms.size() == 1 && terms[0].factor == 1.0 &&
            terms[0].coordinate.kind == Coordinate::Kind::kDrive;
    if (plain) command_of_[static_cast<size_t>(terms[0].coordinate.index)] = c;
  }
  if (!plain || std::find(command_of_.begin(), command_of_.end(), kNone) != command_of_.end()) {
    declined_ = "the scenario does more than command each drive by itself";
    return;
  }
  task_.driven = [this, sample = CommandSample()](double t_s, DrivenSample* driven) mutable {
    EvaluateMotion(prepared_.scenario.motion, t_s, &sample);
    const auto drives = static_cast<Eigen::Index>(command_of_.size());
    for (VecX* v : {&driven->position, &driven->velocity, &driven->acceleration}) v->resize(drives);
    for (Eigen::Index k = 0; k < drives; ++k) {
      const auto c = static_cast<Eigen::Index>(command_of_[static_cast<size_t>(k)]);
      driven->position[k] = sample.position[c];
      driven->velocity[k] = sample.velocity[c];
      driven->acceleration[k] = sample.acceleration[c];
    }
    return RunSummary::Done();
  };
}

OwnRun OwnFileRuns::InChild(const OwnTask& task) const {
  const auto answers = InChildren(1, kTimeout_s, [&](size_t) { return ToBytes(RunOwnFile(task)); });
  std::optional<OwnRun> run;
  if (answers[0]) run = FromBytes<OwnRun>(*answers[0]);
  if (run) return *std::move(run);
  OwnRun failed;
  failed.summary = {
      .stop = Stop::kEngineFailure,
      .message = fmt::format("MuJoCo crashed on it, or took longer than {:g} s", kTimeout_s),
      .where = {},
      .unit = {}};
  return failed;
}

OwnFileRuns::Measured OwnFileRuns::Run(const OwnSettings& settings, const std::string& text) {
  OwnTask task = task_;
  task.settings = settings;
  if (!text.empty()) task.text = text;
  Measured measured;
  measured.run = InChild(task);
  measured.run.trace.witness = role::kSimulated.name;
  measured.error = ErrorOf(measured.run);
  return measured;
}

// The reference at the samples of the runs, which fall on whole steps of the file.
void OwnFileRuns::Solve(const Trace& like) {
  motion_.sample_s = like.time_s.size() > 1 ? like.time_s[1] : motion_.duration_s;
  motion_.duration_s = like.time_s.back();
  truth_ = RunReference(prepared_.mechanisms.reference, motion_);
  truth_->trace.witness = role::kReference.name;
}

OwnError OwnFileRuns::ErrorOf(const OwnRun& run) {
  OwnError error;
  error.failure = run.summary.ok() ? "" : run.summary.message;
  error.time_s = run.summary.time_s;
  if (!error.sound()) return error;
  if (!truth_) Solve(run.trace);
  if (!truth_->summary.ok()) {
    error.failure = "the reference has no forces here: " + truth_->summary.message;
    return error;
  }
  error.cost_ms = run.cost_ms;
  error.gap_m = error.gap_rad = 0.0;
  for (size_t c = 0; c < run.gaps.size(); ++c) {
    const OwnRun::Gap& gap = run.gaps[c];
    if (gap.position_m > error.gap_m) {
      error.gap_m = gap.position_m;
      error.gap_at_s = gap.position_at_s;
      error.joint = run.facts.closures[c];
    }
    if (gap.rotation_rad > error.gap_rad) {
      error.gap_rad = gap.rotation_rad;
      error.gap_rad_at_s = gap.rotation_at_s;
      error.twisted = run.facts.closures[c];
    }
  }
  MeasureForces(run, &error);
  MeasureJointForces(run.trace, &error);
  return error;
}

namespace {

// Where friction at rest leaves the true force within a band, forces of a run that lie in it are
// right: both become the middle. Others are wrong by their distance from the band.
void CloseBands(Trace* run, Trace* truth) {
  for (size_t c = 0; c < truth->channels.size(); ++c) {
    const Channel& band = truth->channels[c];
    if (band.quantity != Quantity::kForceBand) continue;
    const int middle = truth->Find(Quantity::kForce, band.subject);
    const int force = run->Find(Quantity::kForce, band.subject);
    if (middle < 0 || force < 0) continue;
    for (Eigen::Index i = 0; i < truth->values.rows(); ++i) {
      double& half = truth->values(i, static_cast<Eigen::Index>(c));
      const double off = run->values(i, force) - truth->values(i, middle);
      if (half > 0.0) run->values(i, force) -= std::clamp(off, -half, half);
      half = 0.0;
    }
  }
}

}  // namespace

void OwnFileRuns::MeasureForces(const OwnRun& own_run, OwnError* error) const {
  Trace run = own_run.trace, truth = truth_->trace;
  CloseBands(&run, &truth);
  ComparisonInput input = InputOf(prepared_);
  input.motion = &motion_;
  input.twists = &twists_;
  input.start_window_s = 0.0;
  error->force_all = ValueOf(ComparePair(input, run, truth).metrics, Metric::kForceNrmse);
  input.start_window_s = OwnFileAudit().later_s;
  const PairComparison pair = ComparePair(input, run, truth);
  error->force = ValueOf(pair.metrics, Metric::kForceNrmse);
  const auto most = pair.metrics.find(Metric::kForceMax);
  for (const DriveMetrics& drive : pair.drives) {
    if (most == pair.metrics.end() ||
        most->second.channel != ChannelName(Quantity::kForce, drive.drive)) {
      continue;
    }
    error->drive = drive.drive;
    error->force_most = drive.max_error;
    error->force_unit = drive.unit;
    error->force_at_s = drive.time_s;
  }
}

void OwnFileRuns::MeasureJointForces(const Trace& trace, OwnError* error) const {
  double wrong = 0.0, right = 0.0;
  for (size_t c = 0; c < trace.channels.size(); ++c) {
    const Channel& channel = trace.channels[c];
    if (channel.quantity != Quantity::kReaction ||
        Contains(request_.reactions_not_unique, channel.name)) {
      continue;
    }
    const int other = truth_->trace.Find(channel.name);
    if (other < 0) continue;
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      if (trace.time_s[i] < OwnFileAudit().later_s) continue;
      const auto row = static_cast<Eigen::Index>(i);
      const double truth = truth_->trace.values(row, other);
      const double off = trace.values(row, static_cast<Eigen::Index>(c)) - truth;
      if (!std::isfinite(off)) continue;
      wrong += off * off;
      right += truth * truth;
    }
  }
  if (right > 0.0) error->joint_force = std::sqrt(wrong / right);
}

}  // namespace mbv
