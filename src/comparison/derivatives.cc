#include "comparison/derivatives.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "comparison/force_band.h"
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
// Of (2): how far the drives' rates per command exceed their RMS at some pose of the motion.
constexpr double kAlongTheWay = 4.0;
// Of a command's RMS rate: less than this its differences need not show.
constexpr double kShownRates = 1e-6;
// A drive is judged where at least this share of its samples resolves its motion.
constexpr double kJudged = 0.5;
// What turns by more than this between two samples hides whole oscillations [rad].
constexpr double kHidden = 2.0;

// Central differences of orders 4 and 6 at row i of a column, spacing h.
struct Differences {
  double fourth = 0.0, sixth = 0.0;
};
Differences Differentiate(const MatX& values, Eigen::Index i, int column, double h) {
  const auto step = [&](Eigen::Index k) { return values(i + k, column) - values(i - k, column); };
  return {(8 * step(1) - step(2)) / (12 * h), (45 * step(1) - 9 * step(2) + step(3)) / (60 * h)};
}

// RMS of the sixth differences: what alternates from sample to sample counts 64 times.
double SixthDifference(const MatX& values, int column) {
  double sum2 = 0.0;
  for (Eigen::Index i = kReach; i + kReach < values.rows(); ++i) {
    const auto pair = [&](Eigen::Index k) { return values(i + k, column) + values(i - k, column); };
    sum2 += std::pow(pair(3) - 6.0 * pair(2) + 15.0 * pair(1) - 20.0 * values(i, column), 2);
  }
  return std::sqrt(sum2 /
                   static_cast<double>(std::max<Eigen::Index>(1, values.rows() - 2 * kReach)));
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

// The largest within reach of the formulas.
VecX Widest(const VecX& values) {
  VecX widest = values;
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const Eigen::Index from = std::max<Eigen::Index>(0, i - kReach);
    const Eigen::Index to = std::min(values.size() - 1, i + kReach);
    widest[i] = values.segment(from, to - from + 1).maxCoeff();
  }
  return widest;
}

// What the commands themselves show at a witness' samples: how far differences of their values (or
// rates) are from their exact rates (accelerations). A spline through rounded rows has parts that
// alternate from row to row; no difference of samples sees those.
//   u_c = (D x_c − x'_c) / RMS(δ⁶ x'_c),    missed = √Σ_c u_c²                                  (1)
// A drive follows commands by q' = Σ_c J_c x'_c. Where the commands' parts of highest frequency are
// independent, RMS²(δ⁶ q') = Σ_c J_c² RMS²(δ⁶ x'_c), and so
//   |Σ_c J_c (D x_c − x'_c)| ≤ RMS(δ⁶ q') · missed,                                             (2)
// up to the changes of J along the motion. Nothing is missed where the differences of orders 4 and
// 6 of every command show it: then those of the drive do, too.
class MissedByCommands {
 public:
  MissedByCommands(const Motion& motion, const std::vector<double>& time_s) {
    const auto n = static_cast<Eigen::Index>(time_s.size());
    MatX jets(n, 3);
    for (Missed* missed : {&rate_, &acceleration_}) missed->values.setZero(n);
    for (const Command& command : motion.commands) {
      for (Eigen::Index i = 0; i < n; ++i) {
        const Jet jet = Evaluate(command.profile, time_s[static_cast<size_t>(i)]);
        jets.row(i) << jet.value, jet.rate, jet.acceleration;
      }
      Add(jets, 0, time_s[1] - time_s[0], &rate_);
      Add(jets, 1, time_s[1] - time_s[0], &acceleration_);
    }
    for (Missed* missed : {&rate_, &acceleration_}) {
      missed->values = Widest(missed->values.cwiseSqrt());
      if (missed->shown) missed->values.setZero();
    }
  }
  [[nodiscard]] const VecX& of(bool acceleration) const {
    return (acceleration ? acceleration_ : rate_).values;
  }

 private:
  struct Missed {
    VecX values;        // (1), its square while commands are added
    bool shown = true;  // by the commands' differences
  };

  static void Add(const MatX& jets, int value, double h, Missed* sum) {
    const double content = SixthDifference(jets, value + 1);
    if (content == 0.0) return;
    VecX missed = VecX::Zero(jets.rows()), shown = missed;
    for (Eigen::Index i = kReach; i + kReach < jets.rows(); ++i) {
      const auto [fourth, sixth] = Differentiate(jets, i, value, h);
      missed[i] = sixth - jets(i, value + 1);
      shown[i] = std::abs(sixth - fourth);
    }
    const double roundoff = kShownRates * mbv::Rms(jets.col(value + 1));
    const VecX covered = Widest(shown).array() + roundoff;
    sum->shown = sum->shown && (missed.cwiseAbs().array() <= covered.array()).all();
    sum->values += (missed / content).cwiseAbs2();
  }

  Missed rate_, acceleration_;
};

// One column against the derivative of another: the worst sample, and the share of samples that
// resolve the motion.
struct JudgedRate {
  Measured worst = {};
  double share = 0.0;
};
JudgedRate MeasureDerivative(const Trace& trace, int position, int rate, double scale,
                             const VecX& missed, const VecX& turned) {
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
  const double content = SixthDifference(trace.values, rate);
  JudgedRate judged;
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
    const double unseen = kTruncation * truncation + kAlongTheWay * content * missed[i];
    if (unseen > kTruncation * std::max(kUnresolved * rms, kNegligible * scale)) continue;
    if (turned[i] > kHidden) continue;
    judged.share += 1.0;
    const double sixth = differences[static_cast<size_t>(i)].sixth;
    const double error = std::abs(sixth - trace.values(i, rate)) - unseen;
    KeepWorst(&judged.worst, error <= 0.0 ? 0.0 : error / scale,
              trace.time_s[static_cast<size_t>(i)], trace.channels[static_cast<size_t>(rate)].name);
  }
  judged.share = inner > 0.0 ? judged.share / inner : 0.0;
  return judged;
}

// The largest turn between two samples within reach of the formulas [rad]; 0 of lengths.
VecX Turned(const Trace& trace, int position) {
  const auto n = static_cast<Eigen::Index>(trace.time_s.size());
  VecX turned = VecX::Zero(n);
  if (trace.channels[static_cast<size_t>(position)].unit != "rad") return turned;
  for (Eigen::Index i = 1; i < n; ++i) {
    turned[i] = std::abs(trace.values(i, position) - trace.values(i - 1, position));
  }
  return Widest(turned);
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

// Whether the values between samples follow from them: midpoints by four and by six samples differ
// by less than kUnresolved of the RMS value at most of them, which takes about six samples per
// oscillation of this signal. Below `negligible` nothing is to be resolved.
bool IsResolved(const VecX& values, double negligible) {
  constexpr Eigen::Index kHalf = 3;  // samples to either side of a midpoint
  if (!values.allFinite()) return true;
  const double allowed = kUnresolved * std::max(mbv::Rms(values), negligible);
  Eigen::Index resolved = 0, all = 0;
  for (Eigen::Index i = kHalf - 1; i + kHalf < values.size(); ++i, ++all) {
    const auto pair = [&](Eigen::Index k) { return values[i - k] + values[i + 1 + k]; };
    const double by_four = (9.0 * pair(0) - pair(1)) / 16.0;
    const double by_six = (150.0 * pair(0) - 25.0 * pair(1) + 3.0 * pair(2)) / 256.0;
    if (std::abs(by_six - by_four) <= allowed) ++resolved;
  }
  return static_cast<double>(resolved) >= kJudged * static_cast<double>(all);
}

// A power oscillates twice as fast as the motion, and a force may oscillate without it.
std::string UnresolvedForces(const ComparisonInput& input, const Trace& trace) {
  const Mechanism& mechanism = *input.mechanism;
  std::string forces, powers;
  const auto add = [](const std::string& name, std::string* list) {
    *list += (list->empty() ? "" : ", ") + name;
  };
  const ForceScale scale = ForceScaleOf(input, trace);
  for (const Drive& drive : mechanism.drives) {
    const int force = trace.Find(Quantity::kForce, drive.name);
    const int velocity = trace.Find(Quantity::kVelocity, drive.name);
    if (force < 0 || velocity < 0) continue;
    const VecX values = ForceSignal(trace, force).Worst();
    const std::string& unit = trace.channels[static_cast<size_t>(force)].unit;
    const double least = scale.Floor(unit);
    const double rest = RestFloorOf(input, PositionUnit(mechanism, drive), trace).velocity;
    const VecX power = values.cwiseProduct(trace.values.col(velocity));
    if (!IsResolved(values, least)) {
      add(drive.name, &forces);
    } else if (!IsResolved(power, rest * std::max(least, mbv::Rms(values)))) {
      add(drive.name, &powers);
    }
  }
  if (!forces.empty()) return "the samples do not resolve the force of " + forces;
  if (!powers.empty()) return "the samples do not resolve the power of " + powers;
  return "";
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
  const MissedByCommands missed(*input.motion, trace.time_s);
  std::string coarse;
  for (const DriveColumns& drive : drives) {
    const RestFloor rest = RestFloorOf(input, drive.unit, trace);
    const double velocity = std::max(rest.velocity, mbv::Rms(trace.values.col(drive.velocity)));
    const double acceleration =
        std::max(rest.acceleration, mbv::Rms(trace.values.col(drive.acceleration)));
    const VecX turned = Turned(trace, drive.position);
    const JudgedRate first = MeasureDerivative(trace, drive.position, drive.velocity, velocity,
                                               missed.of(false), turned);
    const JudgedRate second = MeasureDerivative(trace, drive.velocity, drive.acceleration,
                                                acceleration, missed.of(true), turned);
    for (const JudgedRate& judged : {first, second}) {
      if (judged.share >= kJudged) KeepWorst(&out->metrics[Metric::kDerivatives], judged.worst);
    }
    if (std::min(first.share, second.share) < kJudged) {
      coarse += (coarse.empty() ? "" : ", ") + drive.name;
    }
  }
  if (!coarse.empty()) {
    out->derivatives_gap = "the samples do not resolve the motion of " + coarse;
  }
}

std::string UnresolvedBySamples(const ComparisonInput& input, const Trace& trace,
                                const WitnessMetrics* measured) {
  constexpr double kTwelvePerOscillation = std::numbers::pi / 6.0;  // six of a power
  if (trace.time_s.size() < 2) return "";
  if (trace.time_s.size() < 2 * kReach + 1) {
    const double h = trace.time_s[1] - trace.time_s[0];
    if (LargestPhase(*input.mechanism, *input.motion, h) <= kTwelvePerOscillation) return "";
    return "the samples are too far apart for a motion so fast";
  }
  WitnessMetrics metrics;
  if (measured == nullptr) MeasureDerivatives(input, trace, &metrics);
  const std::string& gap = (measured == nullptr ? &metrics : measured)->derivatives_gap;
  if (!gap.empty()) return gap;
  return UnresolvedForces(input, trace);
}

}  // namespace mbv
