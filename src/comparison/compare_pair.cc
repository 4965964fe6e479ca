// Metrics of one witness against another.
#include <algorithm>
#include <array>

#include "comparison/comparison.h"
#include "comparison/force_band.h"
#include "comparison/force_scale.h"
#include "comparison/pair_reader.h"
#include "core/spatial.h"

namespace mbv {
namespace {

using internal::Columns;
using internal::KeepWorst;
using internal::PairReader;

Measured AsMeasured(const ErrorSum& sum, double value) {
  return {.value = value, .time_s = sum.worst_time_s(), .channel = sum.worst_channel()};
}

// Drive positions (absolute), velocities and accelerations (relative to their RMS).
void CompareDriveMotion(const ComparisonInput& input, const PairReader& reader,
                        PairComparison* pair) {
  std::map<std::string, ErrorSum> velocity, acceleration;
  for (const Drive& drive : input.mechanism->drives) {
    const std::string unit = PositionUnit(*input.mechanism, drive);
    const std::string position = ChannelName(Quantity::kPosition, drive.name);
    if (const Columns c = reader.Find(position); c.both()) {
      const ErrorSum sum = reader.Sum(position, c, 0.0, unit == "rad");
      const Metric metric = unit == "rad" ? Metric::kPositionRad : Metric::kPositionM;
      KeepWorst(&pair->metrics, metric, AsMeasured(sum, sum.max_error()));
    }
    const std::string rate = ChannelName(Quantity::kVelocity, drive.name);
    const std::string rate2 = ChannelName(Quantity::kAcceleration, drive.name);
    if (const Columns c = reader.Find(rate); c.both()) {
      velocity[unit].Merge(reader.Sum(rate, c, 0.0, false));
    }
    if (const Columns c = reader.Find(rate2); c.both()) {
      acceleration[unit].Merge(reader.Sum(rate2, c, 0.0, false));
    }
  }
  for (const auto& [unit, sum] : velocity) {
    KeepWorst(&pair->metrics, Metric::kVelocity,
              sum.MeasuredNrmse(RestFloorOf(input, unit, reader.truth).velocity));
  }
  for (const auto& [unit, sum] : acceleration) {
    KeepWorst(&pair->metrics, Metric::kAcceleration,
              sum.MeasuredNrmse(RestFloorOf(input, unit, reader.truth).acceleration));
  }
}

// Six columns of an output in one trace.
using OutputColumns = std::array<int, 6>;

std::optional<OutputColumns> FindOutput(const Trace& trace, const Output& output) {
  OutputColumns columns{};
  for (int c = 0; c < 6; ++c) {
    const int column = trace.Find(Quantity::kPose, output.name, c);
    if (column < 0) return {};
    columns[static_cast<size_t>(c)] = column;
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
      KeepWorst(&pair->metrics, Metric::kPoseM,
                {.value = p_error.norm(), .time_s = time_s, .channel = output.name});
      // A NaN matrix has no angle; the sum keeps the NaN.
      const Mat3 R_error = R_b.transpose() * R_a;
      const double angle = R_error.allFinite() ? LogRotation(R_error).norm() : kNan;
      KeepWorst(&pair->metrics, Metric::kPoseRad,
                {.value = angle, .time_s = time_s, .channel = output.name});
    }
  }
}

}  // namespace

ErrorSum internal::PairReader::Sum(const std::string& name, Columns columns, double start_s,
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

ErrorSum internal::PairReader::SumForces(const std::string& name, Columns columns,
                                         double start_s) const {
  ErrorSum sum;
  const ForceSignal a(measured, columns.measured), b(truth, columns.truth);
  for (const auto& [i, j] : samples) {
    const double time_s = measured.time_s[static_cast<size_t>(i)];
    if (time_s < start_s) continue;
    sum.Add(Difference(a.At(i), b.At(j)), b.At(j).middle, time_s, name);
  }
  return sum;
}

PairComparison ComparePair(const ComparisonInput& input, const Trace& measured,
                           const Trace& truth) {
  PairComparison pair;
  pair.measured = measured.witness;
  pair.truth = truth.witness;
  const PairReader reader{measured, truth, AlignSamples(measured, truth)};
  pair.samples = reader.samples.size();
  internal::CompareForces(input, reader, &pair);
  CompareDriveMotion(input, reader, &pair);
  ComparePoses(input, reader, &pair);
  // A free motion is judged by where it leads.
  const bool trajectory = std::any_of(pair.metrics.begin(), pair.metrics.end(),
                                      [](const auto& entry) { return IsTrajectory(entry.first); });
  if (pair.compared && pair.drives.empty() && !trajectory) {
    pair.compared = false;
    pair.reason = "the model has neither drives nor outputs whose motion could be compared";
  }
  internal::CompareReactions(input, reader, &pair);
  return pair;
}

}  // namespace mbv
