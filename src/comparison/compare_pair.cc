// Metrics of one witness against another.
#include <algorithm>
#include <array>
#include <cmath>

#include "comparison/comparison.h"
#include "comparison/driven.h"
#include "comparison/force_scale.h"
#include "core/spatial.h"
#include "mechanism/channels.h"

namespace mbv {
namespace {

// Below these a signal counts as at rest and its relative error is taken from the floor: 1 mm/s
// (or mrad/s), 1 mm/s², and for moments the joint forces at an arm of 1 mm.
constexpr double kVelocityFloor = 1e-3;
constexpr double kAccelerationFloor = 1e-3;
constexpr double kMomentArm_m = 1e-3;
// A drive whose force is smaller than this share of its unit's RMS is judged by that share: a drive
// that holds nothing has no scale of its own.
constexpr double kIdleDrive = ForceScale::kIdle;

// The same channel in both traces; absent if `measured` < 0 or `truth` < 0.
struct Columns {
  int measured = -1, truth = -1;
  [[nodiscard]] bool both() const { return measured >= 0 && truth >= 0; }
};

struct PairReader {
  const Trace& measured;
  const Trace& truth;
  CommonSamples samples;

  [[nodiscard]] Columns Find(const std::string& name) const {
    return {measured.Find(name), truth.Find(name)};
  }
  // Error statistics of one channel over the samples from `start` on.
  [[nodiscard]] ErrorSum Sum(const std::string& name, Columns columns, double start_s,
                             bool angle) const {
    ErrorSum sum;
    for (const auto& [i, j] : samples) {
      const double time_s = measured.time_s[static_cast<size_t>(i)];
      if (time_s < start_s) continue;
      const double a = measured.values(i, columns.measured), b = truth.values(j, columns.truth);
      sum.Add(angle ? AngleDifference(a, b) : a - b, b, time_s, name);
    }
    return sum;
  }
};

Measured AsMeasured(const ErrorSum& sum, double value) {
  return {value, sum.worst_time_s(), sum.worst_channel()};
}

void KeepWorst(std::map<Metric, Measured>* metrics, Metric metric, const Measured& measured) {
  KeepWorst(&(*metrics)[metric], measured.value, measured.time_s, measured.channel);
}

DriveMetrics DriveMetricsOf(const Drive& drive, const std::string& unit, const ErrorSum& force,
                            double floor) {
  return {.drive = drive.name,
          .unit = unit,
          .rms_truth = force.rms_truth(),
          .nrmse = force.Nrmse(floor),
          .max_error = force.max_error(),
          .max_relative = force.MaxRelative(floor),
          .digits = MatchingDigits(force.Nrmse(floor)),
          .time_s = force.worst_time_s()};
}

// RMS of the measured force, and its best fit measured = factor · truth.
void FitFactor(const PairReader& reader, Columns columns, double start_s, DriveMetrics* metrics) {
  double aa = 0.0, ab = 0.0, bb = 0.0, count = 0.0;
  for (const auto& [i, j] : reader.samples) {
    if (reader.measured.time_s[static_cast<size_t>(i)] < start_s) continue;
    const double a = reader.measured.values(i, columns.measured);
    const double b = reader.truth.values(j, columns.truth);
    aa += a * a;
    ab += a * b;
    bb += b * b;
    count += 1.0;
  }
  metrics->rms_measured = std::sqrt(aa / count);
  metrics->factor = ab / bb;
  double residual2 = 0.0;
  for (const auto& [i, j] : reader.samples) {
    if (reader.measured.time_s[static_cast<size_t>(i)] < start_s) continue;
    const double r = reader.measured.values(i, columns.measured) -
                     metrics->factor * reader.truth.values(j, columns.truth);
    residual2 += r * r;
  }
  metrics->factor_residual = std::sqrt(residual2 / bb);
}

// Forces: per drive and pooled over the drives of one unit.
void CompareForces(const ComparisonInput& input, const PairReader& reader, PairComparison* pair) {
  std::map<std::string, ErrorSum> pooled;
  std::vector<std::pair<std::string, ErrorSum>> drives;  // unit and sums, as pair->drives
  const ForceScale scale = ForceScaleOf(input, reader.truth);
  const bool shared = SharesForces(input, reader.measured.witness, reader.truth.witness);
  size_t wanted = 0;
  for (size_t d = 0; d < input.mechanism->drives.size(); ++d) {
    // Given to both.
    if (input.motion->FindForce(static_cast<int>(d)) >= 0) continue;
    if (shared) continue;
    const Drive& drive = input.mechanism->drives[d];
    ++wanted;
    const std::string channel = drive.name + ".force";
    const Columns columns = reader.Find(channel);
    if (!columns.both()) continue;
    const ErrorSum sum = reader.Sum(channel, columns, input.start_window_s, false);
    if (sum.count() == 0) continue;
    const std::string unit = ForceUnit(*input.mechanism, drive);
    pair->drives.push_back(DriveMetricsOf(drive, unit, sum, scale.Floor(unit)));
    FitFactor(reader, columns, input.start_window_s, &pair->drives.back());
    pair->force_samples = sum.count();
    pooled[unit].Merge(sum);
    drives.emplace_back(unit, sum);
  }
  for (const auto& [unit, sum] : drives) {
    const double idle = kIdleDrive * pooled[unit].rms_truth();
    const double floor = std::isnan(idle) ? idle : std::max(idle, scale.Floor(unit));
    KeepWorst(&pair->metrics, Metric::kForceOwn, AsMeasured(sum, sum.Nrmse(floor)));
  }
  for (const auto& [unit, sum] : pooled) {
    KeepWorst(&pair->metrics, Metric::kForceNrmse, AsMeasured(sum, sum.Nrmse(scale.Floor(unit))));
    KeepWorst(&pair->metrics, Metric::kForceMax,
              AsMeasured(sum, sum.MaxRelative(scale.Floor(unit))));
  }
  // A table need not hold every drive.
  const bool table = input.table != nullptr && (reader.measured.witness == "reference" ||
                                                reader.truth.witness == "reference");
  const bool all = pair->drives.size() == wanted || (table && !pair->drives.empty());
  pair->compared =
      all && (!pair->drives.empty() || ((input.motion->free() || shared) && pair->samples > 0));
  if (pair->compared) {
    pair->reason.clear();
    if (!pair->drives.empty()) {
      pair->digits = MatchingDigits(pair->metrics[Metric::kForceNrmse].value);
    }
  } else if (reader.samples.empty()) {
    pair->reason = "the two have no sample time in common";
  } else if (pair->drives.empty()) {
    pair->reason = "no drive force is in both, or no sample is in the judged window";
  } else {
    pair->reason = "drive forces of some drives are missing in one of the two";
  }
}

// Drive positions (absolute), velocities and accelerations (relative to their RMS).
void CompareDriveMotion(const ComparisonInput& input, const PairReader& reader,
                        PairComparison* pair) {
  std::map<std::string, ErrorSum> velocity, acceleration;
  for (const Drive& drive : input.mechanism->drives) {
    const std::string unit = PositionUnit(*input.mechanism, drive);
    const std::string position = drive.name + ".position";
    if (const Columns c = reader.Find(position); c.both()) {
      const ErrorSum sum = reader.Sum(position, c, 0.0, unit == "rad");
      const Metric metric = unit == "rad" ? Metric::kPositionRad : Metric::kPositionM;
      KeepWorst(&pair->metrics, metric, AsMeasured(sum, sum.max_error()));
    }
    const std::string rate = drive.name + ".velocity", rate2 = drive.name + ".acceleration";
    if (const Columns c = reader.Find(rate); c.both()) {
      velocity[unit].Merge(reader.Sum(rate, c, 0.0, false));
    }
    if (const Columns c = reader.Find(rate2); c.both()) {
      acceleration[unit].Merge(reader.Sum(rate2, c, 0.0, false));
    }
  }
  for (const auto& [unit, sum] : velocity) {
    KeepWorst(&pair->metrics, Metric::kVelocity, AsMeasured(sum, sum.Nrmse(kVelocityFloor)));
  }
  for (const auto& [unit, sum] : acceleration) {
    KeepWorst(&pair->metrics, Metric::kAcceleration,
              AsMeasured(sum, sum.Nrmse(kAccelerationFloor)));
  }
}

// Six columns of an output in one trace.
using OutputColumns = std::array<int, 6>;

std::optional<OutputColumns> FindOutput(const Trace& trace, const Output& output) {
  OutputColumns columns{};
  size_t k = 0;
  for (const char* c : {"x", "y", "z", "roll", "pitch", "yaw"}) {
    columns[k] = trace.Find(output.name + "." + c);
    if (columns[k++] < 0) return {};
  }
  return columns;
}

Vec3 Pick(const Trace& trace, Eigen::Index row, const OutputColumns& columns, size_t first) {
  return {trace.values(row, columns[first]), trace.values(row, columns[first + 1]),
          trace.values(row, columns[first + 2])};
}

void ComparePoses(const ComparisonInput& input, const PairReader& reader, PairComparison* pair) {
  for (const Output& output : input.mechanism->outputs) {
    const auto a = FindOutput(reader.measured, output), b = FindOutput(reader.truth, output);
    if (!a || !b) continue;
    for (const auto& [i, j] : reader.samples) {
      const double time_s = reader.measured.time_s[static_cast<size_t>(i)];
      const Vec3 p_error = Pick(reader.measured, i, *a, 0) - Pick(reader.truth, j, *b, 0);
      const Mat3 R_a = RotRpy(Pick(reader.measured, i, *a, 3));
      const Mat3 R_b = RotRpy(Pick(reader.truth, j, *b, 3));
      KeepWorst(&pair->metrics, Metric::kPoseM, {p_error.norm(), time_s, output.name});
      // A NaN matrix has no angle; the sum keeps the NaN.
      const Mat3 R_error = R_b.transpose() * R_a;
      const double angle = R_error.allFinite() ? LogRotation(R_error).norm() : kNan;
      KeepWorst(&pair->metrics, Metric::kPoseRad, {angle, time_s, output.name});
    }
  }
}

// Joint reactions that both give in the same frame and that statics determines.
void CompareReactions(const ComparisonInput& input, const PairReader& reader,
                      PairComparison* pair) {
  ErrorSum forces, moments;
  for (const Joint& joint : input.mechanism->joints) {
    if (FreedomsOf(joint.kind) == 6) continue;  // transmits nothing
    bool compared = false;
    for (const Channel& channel : ReactionChannels(joint)) {
      const Columns c = reader.Find(channel.name);
      if (!c.both()) continue;
      const Channel& a = reader.measured.channels[static_cast<size_t>(c.measured)];
      const Channel& b = reader.truth.channels[static_cast<size_t>(c.truth)];
      if (a.frame != b.frame || a.unit != b.unit) continue;
      if (std::find(input.joints_not_unique.begin(), input.joints_not_unique.end(), joint.name) !=
          input.joints_not_unique.end()) {
        continue;
      }
      (channel.unit == "N" ? forces : moments)
          .Merge(reader.Sum(channel.name, c, input.start_window_s, false));
      compared = true;
    }
    if (compared) pair->reactions.push_back(joint.name);
  }
  const double least = ForceScaleOf(input, reader.truth).Floor("N");
  if (forces.count() > 0) {
    KeepWorst(&pair->metrics, Metric::kReaction, AsMeasured(forces, forces.Nrmse(least)));
  }
  if (moments.count() > 0) {
    const double rms = forces.count() > 0 ? forces.rms_truth() : 0.0;
    const double floor = (std::isnan(rms) ? rms : std::max(rms, least)) * kMomentArm_m;
    KeepWorst(&pair->metrics, Metric::kReaction, AsMeasured(moments, moments.Nrmse(floor)));
  }
}

}  // namespace

PairComparison ComparePair(const ComparisonInput& input, const Trace& measured,
                           const Trace& truth) {
  PairComparison pair;
  pair.measured = measured.witness;
  pair.truth = truth.witness;
  const PairReader reader{measured, truth, AlignSamples(measured, truth)};
  pair.samples = reader.samples.size();
  CompareForces(input, reader, &pair);
  CompareDriveMotion(input, reader, &pair);
  ComparePoses(input, reader, &pair);
  // A free motion is judged by where it leads.
  const bool trajectory = std::any_of(pair.metrics.begin(), pair.metrics.end(),
                                      [](const auto& entry) { return IsTrajectory(entry.first); });
  if (pair.compared && pair.drives.empty() && !trajectory) {
    pair.compared = false;
    pair.reason = "the model has neither drives nor outputs whose motion could be compared";
  }
  CompareReactions(input, reader, &pair);
  return pair;
}

}  // namespace mbv
