#include "features/paper/rerun.h"

#include <algorithm>
#include <cmath>

#include "comparison/table_tube.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

// The table of a packed trace: exact, so that its tubes are the stated limits.
AlignedTable ExactTable(Trace trace) {
  AlignedTable table;
  table.name = "packed";
  table.standard = table.bound = MatX::Zero(trace.values.rows(), trace.values.cols());
  table.trace = std::move(trace);
  table.coverage = 1.0;
  return table;
}

// Forces that friction at rest leaves open are NaN in both.
void AgreeOnUnknown(Trace* a, Trace* b) {
  for (Eigen::Index c = 0; c < a->values.cols(); ++c) {
    for (Eigen::Index i = 0; i < a->values.rows(); ++i) {
      double& x = a->values(i, c);
      double& y = b->values(i, c);
      if (std::isnan(x) && std::isnan(y)) x = y = 0.0;
    }
  }
}

// Signals that no limit is about share the scale of those that they belong to: rates of outputs
// that of the drives' rates, powers and energies one each. Alone, one that is zero but for
// round-off would be held to its round-off.
Quantity JudgedAs(Quantity quantity, const std::string& unit) {
  if (quantity == Quantity::kPoseVelocity) return Quantity::kVelocity;
  if (quantity == Quantity::kPoseAcceleration) return Quantity::kAcceleration;
  if (unit == "W") return Quantity::kInputPower;
  if (unit == "J") return Quantity::kKineticEnergy;
  return quantity;
}

// The largest force or moment of a trace as one or the other; what is below kLoadRoundoff of it is
// none.
constexpr double kLoadRoundoff = 1e-12;

double LargestLoad(const Trace& trace, const std::string& unit, double size_m) {
  double largest = 0.0;
  for (size_t c = 0; c < trace.channels.size(); ++c) {
    const std::string& of = trace.channels[c].unit;
    if (of != "N" && of != "N m") continue;
    const double value = trace.values.rows() == 0
                             ? 0.0
                             : trace.values.col(static_cast<Eigen::Index>(c)).cwiseAbs().maxCoeff();
    const double as = of == unit ? value : unit == "N m" ? value * size_m : value / size_m;
    if (as > largest) largest = as;
  }
  return largest;
}

double LargestOf(const Trace& trace, size_t column) {
  if (trace.values.rows() == 0) return 0.0;
  return trace.values.col(static_cast<Eigen::Index>(column)).cwiseAbs().maxCoeff();
}

double ShareOf(double part, double whole) { return part == 0.0 ? 0.0 : part / whole; }

}  // namespace

CheckLimits RerunLimits(const CheckLimits& limits) {
  CheckLimits own = limits;
  const auto or_default = [](std::optional<double>* limit, const std::optional<double>& usual) {
    if (!*limit) *limit = usual;
  };
  for (const auto rows : {MetricRows(), StiffnessMetricRows()}) {
    for (const MetricRow& row : rows) {
      MetricLimits& metric = own[row.metric];
      or_default(&metric.forward, row.limits.forward);
      or_default(&metric.inverse, row.limits.inverse);
      or_default(&metric.reference, row.limits.reference);
      or_default(&metric.servo, metric.forward);
      for (std::optional<double>* limit : {&metric.forward, &metric.servo}) {
        if (*limit) **limit *= kRerunShare;
      }
    }
  }
  return own;
}

std::vector<RerunSignal> CompareReruns(const ComparisonInput& input, Trace packed, Trace rerun,
                                       LimitColumn column) {
  AgreeOnUnknown(&packed, &rerun);
  for (Channel& channel : packed.channels) {
    channel.quantity = JudgedAs(channel.quantity, channel.unit);
  }
  const std::string witness = rerun.witness;
  const double size_m = CharacteristicLength(*input.mechanism);
  const AlignedTable table = ExactTable(std::move(packed));
  ComparisonInput judged = input;
  judged.table = &table;
  judged.limits = RerunLimits(input.limits);
  judged.start_window_s = 0.0;
  judged.reactions_not_unique.clear();
  std::vector<RerunSignal> signals;
  for (const TableColumnResult& result : JudgeColumns(judged, rerun, column)) {
    signals.push_back({.signal = result.channel + "." + witness,
                       .relative = ShareOf(result.error_max, LargestOf(table.trace, result.column)),
                       .use = result.ratio(),
                       .time_s = result.time_s});
    const std::string& unit = table.trace.channels[result.column].unit;
    const double roundoff = kLoadRoundoff * LargestLoad(table.trace, unit, size_m);
    const bool is_load = unit == "N" || unit == "N m";
    if (is_load && result.error_max <= roundoff) signals.back().use = 0.0;
  }
  return signals;
}

RerunSignal CompareColumns(const std::string& name, const std::vector<double>& packed,
                           const std::vector<double>& rerun, double limit, bool absolute) {
  ErrorSum sum;
  for (size_t i = 0; i < packed.size() && i < rerun.size(); ++i) {
    const bool unknown = std::isnan(packed[i]) && std::isnan(rerun[i]);
    sum.Add(unknown ? 0.0 : rerun[i] - packed[i], unknown ? 0.0 : packed[i], kNan, name);
  }
  RerunSignal signal{.signal = name};
  const bool comparable = packed.size() == rerun.size();
  signal.relative = comparable ? sum.MaxRelative() : kNan;
  signal.use = ShareOf(absolute && comparable ? sum.max_error() : signal.relative, limit);
  return signal;
}

}  // namespace mbv
