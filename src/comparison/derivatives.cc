#include "comparison/derivatives.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/force_scale.h"

namespace mbv {
namespace {

constexpr Eigen::Index kReach = 3;  // samples to either side that the formulas use
constexpr double kTimesOff = 1e-6;  // of times, by their distance
// Where the formulas differ, the truncation error of the sixth-order one is taken off: smooth
// motions lose nothing, and jumps of the jerk do not count. A jump J of the jerk makes an error of
// up to 0.15 J h, while the formulas differ by at least 0.0125 J h at the nearest sample: a factor
// of 12, within three samples.
constexpr double kTruncation = 12.0;
// That factor holds while the formulas differ by less than this share of the RMS rate (about six
// samples per oscillation) …
constexpr double kUnresolved = 0.03;
// … and a difference below this share of the scale is round-off, however small the rate.
constexpr double kNegligible = 1e-4;
// Commands that turn by more than this between two samples hide whole oscillations [rad].
constexpr double kHidden = 2.0;

// Central differences of orders 4 and 6 at row i of a column, spacing h.
struct Differences {
  double fourth = 0.0, sixth = 0.0;
};
Differences Differentiate(const MatX& values, Eigen::Index i, int column, double h) {
  const auto step = [&](Eigen::Index k) { return values(i + k, column) - values(i - k, column); };
  return {(8 * step(1) - step(2)) / (12 * h), (45 * step(1) - 9 * step(2) + step(3)) / (60 * h)};
}

double Rms(const Trace& trace, int column) {
  return std::sqrt(trace.values.col(column).squaredNorm() /
                   static_cast<double>(trace.values.rows()));
}

// Phase by which the fastest command goes on between two samples.
double LargestPhase(const Mechanism& mechanism, const Motion& motion, double h) {
  constexpr int kBetween = 4, kMost = 20000;
  const int count = static_cast<int>(std::min<double>(kMost, kBetween * motion.duration_s / h));
  double largest = 0.0;
  for (const Command& command : motion.commands) {
    double rate2 = 0.0, acceleration2 = 0.0, fastest = 0.0;
    for (int i = 0; i <= count; ++i) {
      const Jet jet = Evaluate(command.profile, h / kBetween * i);
      rate2 += jet.rate * jet.rate;
      acceleration2 += jet.acceleration * jet.acceleration;
      fastest = std::max(fastest, std::abs(jet.rate));
    }
    if (rate2 > 0.0) largest = std::max(largest, h * std::sqrt(acceleration2 / rate2));
    const bool turns =
        !command.terms.empty() && !IsLength(mechanism, command.terms.front().coordinate);
    if (turns) largest = std::max(largest, h * fastest);
  }
  return largest;
}

// True if accelerations jump among the samples that the formulas use, and where round-off may have
// put them on the other side.
bool NearBreak(const Trace& trace, Eigen::Index i) {
  const double h = trace.time_s[1] - trace.time_s[0];
  const double from = trace.time_s[static_cast<size_t>(i - kReach)] - kTimesOff * h;
  const double to = trace.time_s[static_cast<size_t>(i + kReach)] + kTimesOff * h;
  return std::ranges::any_of(trace.breaks_s, [&](double t) { return from <= t && t <= to; });
}

// One column against the derivative of another; returns the share of samples that were judged.
double MeasureDerivative(const Trace& trace, int position, int rate, double scale,
                         WitnessMetrics* out) {
  const auto n = static_cast<Eigen::Index>(trace.time_s.size());
  const double h = trace.time_s[1] - trace.time_s[0];
  std::vector<Differences> differences(trace.time_s.size());
  double sum2 = 0.0;
  for (Eigen::Index i = kReach; i + kReach < n; ++i) {
    differences[static_cast<size_t>(i)] = Differentiate(trace.values, i, position, h);
    sum2 += std::pow(differences[static_cast<size_t>(i)].sixth, 2);
  }
  auto inner = static_cast<double>(n - 2 * kReach);
  const double rms = std::sqrt(sum2 / inner);
  double judged = 0.0;
  for (Eigen::Index i = kReach; i + kReach < n; ++i) {
    if (NearBreak(trace, i)) {
      inner -= 1.0;
      continue;
    }
    double truncation = 0.0;
    for (Eigen::Index k = std::max(kReach, i - kReach); k <= std::min(n - 1 - kReach, i + kReach);
         ++k) {
      const auto [fourth, sixth] = differences[static_cast<size_t>(k)];
      truncation = std::max(truncation, std::abs(sixth - fourth));
    }
    if (truncation > kUnresolved * rms && truncation > kNegligible * scale) continue;
    judged += 1.0;
    const double sixth = differences[static_cast<size_t>(i)].sixth;
    const double error = std::abs(sixth - trace.values(i, rate)) - kTruncation * truncation;
    KeepWorst(&out->metrics[Metric::kDerivatives], error <= 0.0 ? 0.0 : error / scale,
              trace.time_s[static_cast<size_t>(i)], trace.channels[static_cast<size_t>(rate)].name);
  }
  return inner > 0.0 ? judged / inner : 0.0;
}

struct DriveColumns {
  int position = -1, velocity = -1, acceleration = -1;
  std::string name, unit;
};

std::vector<DriveColumns> FindColumns(const Mechanism& mechanism, const Trace& trace) {
  std::vector<DriveColumns> all;
  for (const Drive& drive : mechanism.drives) {
    const DriveColumns columns{trace.Find(Quantity::kPosition, drive.name),
                               trace.Find(Quantity::kVelocity, drive.name),
                               trace.Find(Quantity::kAcceleration, drive.name), drive.name,
                               PositionUnit(mechanism, drive)};
    if (columns.position < 0 || columns.velocity < 0 || columns.acceleration < 0) continue;
    all.push_back(columns);
  }
  return all;
}

}  // namespace

void MeasureDerivatives(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  const std::vector<DriveColumns> drives = FindColumns(*input.mechanism, trace);
  if (drives.empty()) return;
  if (trace.time_s.size() < 2 * kReach + 1) {
    out->derivatives_gap = fmt::format("{} samples are too few: differences need {}",
                                       trace.time_s.size(), 2 * kReach + 1);
    return;
  }
  if (LargestPhase(*input.mechanism, *input.motion, trace.time_s[1] - trace.time_s[0]) > kHidden) {
    out->derivatives_gap = "the samples are too far apart for a motion so fast";
    return;
  }
  std::string coarse;
  for (const DriveColumns& drive : drives) {
    const RestFloor rest = RestFloorOf(input, drive.unit, trace);
    const double velocity = std::max(rest.velocity, Rms(trace, drive.velocity));
    const double acceleration = std::max(rest.acceleration, Rms(trace, drive.acceleration));
    const double first = MeasureDerivative(trace, drive.position, drive.velocity, velocity, out);
    const double second =
        MeasureDerivative(trace, drive.velocity, drive.acceleration, acceleration, out);
    if (std::min(first, second) < 0.5) coarse += (coarse.empty() ? "" : ", ") + drive.name;
  }
  if (!coarse.empty()) {
    out->derivatives_gap = "the samples do not resolve the motion of " + coarse;
  }
}

}  // namespace mbv
