// Drive forces of one witness against another.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/driven.h"
#include "comparison/force_band.h"
#include "comparison/force_scale.h"
#include "comparison/pair_reader.h"

namespace mbv::internal {
namespace {

// Fewer samples behind a start window are a window around what disagrees.
constexpr size_t kFewestBehindWindow = 5;

struct DriveError {
  size_t drive = 0;
  std::string unit;
  ErrorSum sum;
};

// From 0.1 % of the drive's own scale, or of the RMS force of the drives that carry the same,
// whichever is larger: a drive that holds nothing has no scale of its own.
double FloorOf(const ForceScale& scale, const std::vector<DriveError>& errors, size_t drive,
               const std::string& unit) {
  ErrorSum same;
  for (const DriveError& other : errors) {
    if (other.unit == unit && scale.carries[other.drive][drive]) same.Merge(other.sum);
  }
  const double idle = ForceScale::kIdle * same.rms_truth();
  return std::isnan(idle) ? idle : std::max(idle, scale.Floor(drive));
}

DriveMetrics DriveMetricsOf(const Drive& drive, const std::string& unit, const ErrorSum& force,
                            double floor) {
  const Measured nrmse = force.MeasuredNrmse(floor);
  return {.drive = drive.name,
          .unit = unit,
          .rms_truth = force.rms_truth(),
          .nrmse = nrmse.value,
          .max_error = force.max_error(),
          .max_relative = force.MaxRelative(floor),
          .digits = MatchingDigits(nrmse.value),
          .floored = nrmse.floored,
          .time_s = force.worst_time_s()};
}

// RMS of the measured force, and its best fit measured = factor · truth, where both are numbers.
void FitFactor(const PairReader& reader, Columns columns, double start_s, DriveMetrics* metrics) {
  const ForceSignal measured(reader.measured, columns.measured);
  const ForceSignal truth(reader.truth, columns.truth);
  double all = 0.0, ab = 0.0, bb = 0.0, count = 0.0;
  std::vector<std::pair<double, double>> numbers;
  for (const auto& [i, j] : reader.samples) {
    if (reader.measured.time_s[static_cast<size_t>(i)] < start_s) continue;
    const ForceBand a = measured.At(i), b = truth.At(j);
    all += a.middle * a.middle;
    count += 1.0;
    if (a.open() || b.open()) continue;
    ab += a.middle * b.middle;
    bb += b.middle * b.middle;
    numbers.emplace_back(a.middle, b.middle);
  }
  metrics->rms_measured = std::sqrt(all / count);
  metrics->factor = ab / bb;
  double residual2 = 0.0, offset = 0.0, beside2 = 0.0;
  for (const auto& [a, b] : numbers) {
    const double r = a - metrics->factor * b;
    residual2 += r * r;
    offset += (a - b) / static_cast<double>(numbers.size());
  }
  for (const auto& [a, b] : numbers) beside2 += (a - b - offset) * (a - b - offset);
  metrics->factor_residual = std::sqrt(residual2 / bb);
  metrics->offset_residual = std::sqrt(beside2 / bb);
}

// Errors of all drives that both have; `wanted` counts those that are not given their force.
std::vector<DriveError> DriveErrors(const ComparisonInput& input, const PairReader& reader,
                                    size_t* wanted) {
  std::vector<DriveError> errors;
  for (size_t d = 0; d < input.mechanism->drives.size(); ++d) {
    // Given to both.
    if (input.motion->FindForce(static_cast<int>(d)) >= 0) continue;
    if (SharesForces(input, reader.measured.witness, reader.truth.witness)) continue;
    const Drive& drive = input.mechanism->drives[d];
    ++*wanted;
    const std::string channel = ChannelName(Quantity::kForce, drive.name);
    const Columns columns = reader.Find(channel);
    if (!columns.both()) continue;
    const ErrorSum sum = reader.SumForces(channel, columns, input.start_window_s);
    if (sum.count() > 0) errors.push_back({d, ForceUnit(*input.mechanism, drive), sum});
  }
  return errors;
}

// Where forces were judged, in time.
void FindSpan(const ComparisonInput& input, const PairReader& reader, PairComparison* pair) {
  for (const auto& [i, j] : reader.samples) {
    const double time_s = reader.measured.time_s[static_cast<size_t>(i)];
    if (time_s < input.start_window_s) continue;
    if (std::isnan(pair->from_s)) pair->from_s = time_s;
    pair->to_s = time_s;
  }
}

// Samples in the judged window at which friction at rest leaves some force open in one of the two.
size_t CountAtRest(const ComparisonInput& input, const PairReader& reader) {
  const std::vector<bool> a = AtRest(reader.measured), b = AtRest(reader.truth);
  size_t count = 0;
  for (const auto& [i, j] : reader.samples) {
    const auto row = static_cast<size_t>(i);
    if (reader.measured.time_s[row] < input.start_window_s) continue;
    count += a[row] || b[static_cast<size_t>(j)] ? 1 : 0;
  }
  return count;
}

// Says why the pair's forces were not compared; "" if they were. A table need not hold every drive.
std::string WhyNot(const ComparisonInput& input, const PairReader& reader, size_t wanted,
                   const PairComparison& pair) {
  const bool table = input.table != nullptr && pair.Involves(role::kReference);
  if (reader.samples.empty()) return "the two have no sample time in common";
  const bool motion_only =
      input.motion->free() || SharesForces(input, reader.measured.witness, reader.truth.witness);
  if (pair.drives.empty() && !(motion_only && wanted == 0)) {
    return "no drive force is in both, or no sample is in the judged window";
  }
  if (pair.drives.size() != wanted && !table) {
    return "drive forces of some drives are missing in one of the two";
  }
  if (input.start_window_s > 0.0 && !pair.drives.empty() &&
      pair.force_samples < kFewestBehindWindow) {
    return fmt::format("the start window of {:g} s leaves {} sample{} to judge, fewer than {}",
                       input.start_window_s, pair.force_samples, pair.force_samples == 1 ? "" : "s",
                       kFewestBehindWindow);
  }
  return "";
}

}  // namespace

void CompareForces(const ComparisonInput& input, const PairReader& reader, PairComparison* pair) {
  const ForceScale scale = ForceScaleOf(input, reader.truth);
  size_t wanted = 0;
  const std::vector<DriveError> errors = DriveErrors(input, reader, &wanted);
  std::map<std::string, ErrorSum> pooled;
  for (const auto& [d, unit, sum] : errors) {
    const Drive& drive = input.mechanism->drives[d];
    const double floor = FloorOf(scale, errors, d, unit);
    pair->drives.push_back(DriveMetricsOf(drive, unit, sum, floor));
    FitFactor(reader, reader.Find(ChannelName(Quantity::kForce, drive.name)), input.start_window_s,
              &pair->drives.back());
    KeepWorst(&pair->metrics, Metric::kForceOwn, sum.MeasuredNrmse(floor));
    pair->force_samples = sum.count();
    pooled[unit].Merge(sum);
  }
  for (const auto& [unit, sum] : pooled) {
    const double floor = scale.Floor(unit);
    KeepWorst(&pair->metrics, Metric::kForceNrmse, sum.MeasuredNrmse(floor));
    KeepWorst(&pair->metrics, Metric::kForceMax, sum.MeasuredMax(floor));
  }
  FindSpan(input, reader, pair);
  pair->samples_at_rest = CountAtRest(input, reader);
  pair->forces_act = scale.acts;
  pair->reason = WhyNot(input, reader, wanted, *pair);
  pair->compared = pair->reason.empty();
  if (pair->compared && !pair->drives.empty()) {
    pair->digits = MatchingDigits(pair->metrics[Metric::kForceNrmse].value);
  }
}

}  // namespace mbv::internal
