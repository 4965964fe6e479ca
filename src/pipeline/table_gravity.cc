#include "pipeline/table_gravity.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "comparison/metrics.h"
#include "reference/reference.h"

namespace mbv {
namespace {

constexpr double kUsual[] = {9.80665, 9.81, 9.8};
constexpr double kNear = 2e-3, kSame = 1e-9;  // relative
// Another g must take away this much of the difference.
constexpr double kClearly = 0.2;

// RMS over the table's force columns of their difference to a run with this gravity, each relative
// to its own RMS; empty where the run or the columns are missing.
std::optional<double> Misfit(Mechanism mechanism, const Motion& motion, const AlignedTable& table,
                             double start_window_s, double g) {
  mechanism.gravity_W *= g / mechanism.gravity_W.norm();
  const ReferenceRun run = RunReference(mechanism, motion);
  if (!run.summary.ok()) return {};
  const CommonSamples samples = AlignSamples(table.trace, run.trace);
  double sum2 = 0.0, columns = 0.0;
  for (size_t c = 0; c < table.trace.channels.size(); ++c) {
    const Channel& channel = table.trace.channels[c];
    const int other = run.trace.Find(channel.name);
    const bool force =
        channel.quantity == Quantity::kForce || channel.quantity == Quantity::kBaseForce;
    if (!force || other < 0) continue;
    ErrorSum sum;
    for (const auto& [i, j] : samples) {
      const double time_s = table.trace.time_s[static_cast<size_t>(i)];
      if (time_s < start_window_s) continue;
      const double value = table.trace.values(i, static_cast<Eigen::Index>(c));
      sum.Add(value - run.trace.values(j, other), value, time_s, channel.name);
    }
    if (sum.count() == 0 || !(sum.rms_truth() > 0.0)) continue;
    sum2 += sum.Nrmse() * sum.Nrmse();
    columns += 1.0;
  }
  if (columns == 0.0) return {};
  return std::sqrt(sum2 / columns);
}

}  // namespace

std::string GravityDoubt(const Mechanism& mechanism, const Motion& motion,
                         const AlignedTable& table, double start_window_s) {
  const double g = mechanism.gravity_W.norm();
  if (!(std::abs(g / kUsual[0] - 1.0) < kNear)) return "";
  const auto own = Misfit(mechanism, motion, table, start_window_s, g);
  if (!own) return "";
  std::string text;
  double best = kClearly * *own;
  for (const double usual : kUsual) {
    if (std::abs(g / usual - 1.0) < kSame) continue;
    const auto other = Misfit(mechanism, motion, table, start_window_s, usual);
    if (!other || !(*other < best)) continue;
    best = *other;
    text = fmt::format(
        "the forces of the table {} fit g = {:g} m/s² better than the model's {:g}: RMS difference "
        "{:.1e} instead of {:.1e} of their own RMS",
        table.name, usual, g, *other, *own);
  }
  return text;
}

}  // namespace mbv
