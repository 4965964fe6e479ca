#include "comparison/table_tube.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "comparison/force_band.h"
#include "comparison/force_scale.h"
#include "mechanism/channels.h"

namespace mbv {
namespace {

// Signals without a limit on their largest difference get this multiple of the RMS one.
constexpr double kPeakOverRms = 10.0;

constexpr Metric kRmsMetrics[] = {Metric::kForceNrmse,   Metric::kForceOwn, Metric::kVelocity,
                                  Metric::kAcceleration, Metric::kReaction, Metric::kReactionOwn,
                                  Metric::kBaseForce};
constexpr Metric kMaxMetrics[] = {Metric::kForceMax, Metric::kPositionM, Metric::kPositionRad,
                                  Metric::kPoseM, Metric::kPoseRad};

// The rows and channels that a table and another witness share.
struct Shared {
  Trace table, other;           // same rows and channels
  MatX standard, bound;         // as both
  MatX half;                    // half-widths of the other's forces
  std::vector<size_t> columns;  // of the table's trace
};

Shared Share(const AlignedTable& table, const Trace& other) {
  Shared shared;
  std::vector<ForceSignal> from_other;
  std::vector<Channel> channels;
  for (size_t c = 0; c < table.trace.channels.size(); ++c) {
    const int column = other.Find(table.trace.channels[c].name);
    if (column < 0) continue;
    shared.columns.push_back(c);
    from_other.emplace_back(other, column);
    channels.push_back(table.trace.channels[c]);
  }
  const CommonSamples samples = AlignSamples(table.trace, other);
  std::vector<double> times;
  for (const auto& [i, j] : samples) times.push_back(table.trace.time_s[static_cast<size_t>(i)]);
  shared.table.witness = "table";
  shared.table.Reset(times, channels);
  shared.other = shared.table;
  shared.standard = shared.bound = shared.half = shared.table.values;
  shared.half.setZero();
  for (size_t k = 0; k < samples.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const auto [i, j] = samples[k];
    for (size_t c = 0; c < channels.size(); ++c) {
      const auto to = static_cast<Eigen::Index>(c);
      const auto from = static_cast<Eigen::Index>(shared.columns[c]);
      shared.table.values(row, to) = table.trace.values(i, from);
      const ForceBand force = from_other[c].At(j);
      shared.other.values(row, to) = force.middle;
      shared.half(row, to) = force.half;
      shared.standard(row, to) = table.standard(i, from);
      shared.bound(row, to) = table.bound(i, from);
    }
  }
  return shared;
}

// The trace that differs from `truth` by the uncertainty.
Trace Perturbed(const Trace& truth, const MatX& uncertainty) {
  Trace perturbed = truth;
  perturbed.values += uncertainty;
  return perturbed;
}

// Limits of a scenario in a column's own unit; empty where they are switched off.
class StatedLimits {
 public:
  StatedLimits(const ComparisonInput& input, const Shared& shared, LimitColumn column)
      : input_(input), shared_(shared), column_(column) {}

  struct Limits {
    double rms = 0.0, max = 0.0;
  };
  [[nodiscard]] std::optional<Limits> Of(Eigen::Index c) const {
    const Channel& channel = shared_.table.channels[static_cast<size_t>(c)];
    const bool angle = channel.unit == "rad";
    const Pooled pooled = Pool(channel.quantity, channel.unit);
    const RestFloor rest =
        RestFloorOf(input_, channel.unit.starts_with("rad") ? "rad" : "m", shared_.table);
    switch (channel.quantity) {
      case Quantity::kForce: {
        const auto rms = Limit(Metric::kForceNrmse), max = Limit(Metric::kForceMax);
        if (!rms && !max) return {};
        return Limits{rms ? *rms * pooled.rms : kOff, max ? *max * pooled.max : kOff};
      }
      case Quantity::kPosition:
        return Absolute(angle ? Metric::kPositionRad : Metric::kPositionM);
      case Quantity::kPose:
        return Absolute(angle ? Metric::kPoseRad : Metric::kPoseM);
      case Quantity::kVelocity:
        return Relative(Metric::kVelocity, std::max(pooled.rms, rest.velocity));
      case Quantity::kAcceleration:
        return Relative(Metric::kAcceleration, std::max(pooled.rms, rest.acceleration));
      case Quantity::kReaction:
        return Relative(Metric::kReaction, pooled.rms);
      case Quantity::kBaseForce:
        return Relative(Metric::kBaseForce, pooled.rms);
      case Quantity::kLoopGap:
        return Absolute(Metric::kClosureM);
      case Quantity::kLoopTwist:
        return Absolute(Metric::kClosureRad);
      default:  // what no metric is about
        return Relative(Metric::kForceNrmse, pooled.rms);
    }
  }

 private:
  static constexpr double kOff = std::numeric_limits<double>::infinity();
  struct Pooled {
    double rms = 0.0, max = 0.0;
  };

  [[nodiscard]] std::optional<double> Limit(Metric metric) const {
    return input_.limits[metric].Of(column_);
  }
  [[nodiscard]] std::optional<Limits> Absolute(Metric metric) const {
    const auto limit = Limit(metric);
    if (!limit) return {};
    return Limits{*limit, *limit};
  }
  [[nodiscard]] std::optional<Limits> Relative(Metric metric, double scale) const {
    const auto limit = Limit(metric);
    if (!limit) return {};
    return Limits{*limit * scale, kPeakOverRms * *limit * scale};
  }

  // All columns of one quantity and unit.
  [[nodiscard]] Pooled Pool(Quantity quantity, const std::string& unit) const {
    double sum2 = 0.0, count = 0.0;
    Pooled pooled;
    for (Eigen::Index c = 0; c < shared_.table.values.cols(); ++c) {
      const Channel& channel = shared_.table.channels[static_cast<size_t>(c)];
      if (channel.unit != unit || channel.quantity != quantity) continue;
      const auto column = shared_.table.values.col(c);
      sum2 += column.squaredNorm();
      count += static_cast<double>(column.size());
      if (column.size() > 0) pooled.max = std::max(pooled.max, column.cwiseAbs().maxCoeff());
    }
    pooled.rms = count > 0.0 ? std::sqrt(sum2 / count) : 0.0;
    return pooled;
  }

  const ComparisonInput& input_;
  const Shared& shared_;
  LimitColumn column_;
};

bool IsForceLike(Quantity quantity) {
  return quantity == Quantity::kForce || quantity == Quantity::kBaseForce ||
         quantity == Quantity::kReaction || quantity == Quantity::kOwn;
}

// Differences of one column; the start-up window is left out of forces.
TableColumnResult Measure(const ComparisonInput& input, const Shared& shared, Eigen::Index c) {
  const auto k = static_cast<size_t>(c);
  const Channel& channel = shared.table.channels[k];
  const bool windowed = IsForceLike(channel.quantity);
  TableColumnResult result{.channel = channel.name, .column = shared.columns[k]};
  ErrorSum difference, standard;
  double bound = 0.0;
  for (size_t i = 0; i < shared.table.time_s.size(); ++i) {
    const double time_s = shared.table.time_s[i];
    if (windowed && time_s < input.start_window_s) continue;
    const auto row = static_cast<Eigen::Index>(i);
    const double a = shared.table.values(row, c), b = shared.other.values(row, c);
    const double error =
        channel.unit == "rad"
            ? AngleDifference(a, b)
            : Difference({.middle = a}, {.middle = b, .half = shared.half(row, c)});
    difference.Add(error, a, time_s, channel.name);
    standard.Add(shared.standard(row, c), 0.0, time_s, channel.name);
    bound = std::max(bound, shared.bound(row, c));
  }
  result.samples = difference.count();
  if (result.samples == 0) return result;
  result.rms = difference.rms_truth();
  result.standard = standard.rms_error();
  result.bound = bound;
  result.error_rms = difference.rms_error();
  result.error_max = difference.max_error();
  result.time_s = difference.worst_time_s();
  return result;
}

bool IsNotUnique(const ComparisonInput& input, const std::string& channel) {
  const auto& open = input.reactions_not_unique;
  return std::find(open.begin(), open.end(), channel) != open.end();
}

}  // namespace

double TableColumnResult::ratio() const {
  // 0/0: both vanish, as a column of zeros that is exactly met.
  const auto part = [](double error, double tube) {
    return error == 0.0 && tube == 0.0 ? 0.0 : error / tube;
  };
  const double rms = part(error_rms, tube_rms), max = part(error_max, tube_max);
  return std::isnan(rms) || std::isnan(max) ? kNan : std::max(rms, max);
}

bool IsTable(const ComparisonInput& input, const std::string& witness) {
  return input.table != nullptr && witness == role::kReference;
}

std::map<Metric, double> TubeLimits(const ComparisonInput& input, const Trace& other,
                                    bool table_is_truth) {
  const Shared shared = Share(*input.table, other);
  const Trace& truth = table_is_truth ? shared.table : shared.other;
  ComparisonInput plain = input;
  plain.table = nullptr;
  const PairComparison rms = ComparePair(plain, Perturbed(truth, shared.standard), truth);
  const PairComparison max = ComparePair(plain, Perturbed(truth, shared.bound), truth);
  std::map<Metric, double> tubes;
  const auto take = [&](const PairComparison& pair, Metric metric) {
    const auto found = pair.metrics.find(metric);
    if (found != pair.metrics.end()) tubes[metric] = input.table->coverage * found->second.value;
  };
  for (const Metric metric : kRmsMetrics) take(rms, metric);
  for (const Metric metric : kMaxMetrics) take(max, metric);
  return tubes;
}

std::map<Metric, double> CommandTubes(const ComparisonInput& input) {
  const AlignedTable& table = *input.table;
  std::map<Metric, double> tubes;
  for (size_t c = 0; c < table.trace.channels.size(); ++c) {
    if (table.bound.rows() == 0) break;
    const double bound = table.bound.col(static_cast<Eigen::Index>(c)).maxCoeff();
    const std::string& unit = table.trace.channels[c].unit;
    if (unit != "m" && unit != "rad") continue;
    // A command may be the difference of two coordinates.
    double& tube = tubes[unit == "m" ? Metric::kCommandM : Metric::kCommandRad];
    tube = std::max(tube, 2.0 * table.coverage * bound);
  }
  return tubes;
}

std::vector<TableColumnResult> JudgeColumns(const ComparisonInput& input, const Trace& other,
                                            LimitColumn column) {
  const Shared shared = Share(*input.table, other);
  const StatedLimits stated(input, shared, column);
  std::vector<TableColumnResult> results;
  for (Eigen::Index c = 0; c < shared.table.values.cols(); ++c) {
    if (IsNotUnique(input, shared.table.channels[static_cast<size_t>(c)].name)) continue;
    const auto limits = stated.Of(c);
    if (!limits) continue;
    TableColumnResult result = Measure(input, shared, c);
    if (result.samples == 0) continue;
    result.tube_rms = std::max(input.table->coverage * result.standard, limits->rms);
    result.tube_max = std::max(input.table->coverage * result.bound, limits->max);
    results.push_back(std::move(result));
  }
  return results;
}

Measured WorstOf(const std::vector<TableColumnResult>& columns) {
  Measured worst;
  for (const TableColumnResult& column : columns) {
    KeepWorst(&worst, column.ratio(), column.time_s, column.channel);
  }
  return worst;
}

std::string TooCoarse(const ComparisonInput& input, const std::map<Metric, double>& tubes,
                      const std::vector<TableColumnResult>& columns) {
  const AlignedTable& table = *input.table;
  bool any_force = false, all_coarse = true;
  for (const TableColumnResult& column : columns) {
    const Quantity quantity = table.trace.channels[column.column].quantity;
    any_force = any_force || quantity == Quantity::kForce;
    all_coarse = all_coarse && table.coverage * column.standard > table.coarsest * column.rms;
  }
  if (columns.empty()) return "";
  const auto force = tubes.find(Metric::kForceNrmse);
  const bool coarse_force = any_force && force != tubes.end() && !(force->second <= table.coarsest);
  if (coarse_force) {
    return fmt::format(
        "the table {} is too coarse to verify anything: {:g} times its own or stated "
        "uncertainty is {:.2g} % of the RMS force (at most {:g} %)",
        table.name, table.coverage, 100.0 * force->second, 100.0 * table.coarsest);
  }
  if (all_coarse && !any_force) {
    return fmt::format(
        "the table {} is too coarse to verify anything: {:g} times its own or stated "
        "uncertainty exceeds {:g} % of every column",
        table.name, table.coverage, 100.0 * table.coarsest);
  }
  return "";
}

}  // namespace mbv
