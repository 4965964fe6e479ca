// What one witness shows by itself: commands followed, loops closed, power balanced, and rates
// that are the derivatives of their positions.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "comparison/comparison.h"
#include "comparison/driven.h"
#include "comparison/force_band.h"
#include "comparison/force_scale.h"
#include "comparison/motor_load.h"
#include "mechanism/motion.h"

namespace mbv {

namespace {

// The energy scale is never below what the force scale does over this share of the
// characteristic length.
constexpr double kShortest = 1e-3;
// A part explains the drift if what is left of it, RMS, is below this share; two parts that do so
// equally well (within the second factor) are both named.
constexpr double kExplained = 0.3, kTie = 2.0;

struct Curve {
  std::string name;
  bool stored = false;  // a change of energy; otherwise work
  VecX values;          // [J], 0 at the start
};

// ∫ P dt by the cubics through four samples each.
VecX Integral(const VecX& P, double h) {
  const Eigen::Index n = P.size();
  VecX work = VecX::Zero(n);
  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    double sum = 0.0;
    if (i == 0) {
      sum = 9 * P[0] + 19 * P[1] - 5 * P[2] + P[3];
    } else if (i + 2 < n) {
      sum = -P[i - 1] + 13 * P[i] + 13 * P[i + 1] - P[i + 2];
    } else {
      sum = P[i - 2] - 5 * P[i - 1] + 19 * P[i] + 9 * P[i + 1];
    }
    work[i + 1] = work[i] + h / 24.0 * sum;
  }
  return work;
}

std::optional<VecX> Column(const Trace& trace, Quantity quantity, const std::string& subject = "") {
  const int column = trace.Find(quantity, subject);
  if (column < 0) return {};
  return trace.values.col(column);
}

// Works of drives, base, loads and dampers: integrated by the witness, or from its powers.
bool AddWorks(const Mechanism& mechanism, const Trace& trace, std::vector<Curve>* curves) {
  const double h = trace.time_s[1] - trace.time_s[0];
  bool integrated = true;
  const auto add = [&](const std::string& title, const std::optional<VecX>& work,
                       const VecX& power) {
    if (work) {
      curves->push_back({title, false, *work});
      return;
    }
    integrated = false;
    if (power.size() > 0) curves->push_back({title, false, Integral(power, h)});
  };
  const VecX none;
  for (const Drive& drive : mechanism.drives) {
    const auto force = Column(trace, Quantity::kForce, drive.name);
    const auto velocity = Column(trace, Quantity::kVelocity, drive.name);
    add(drive.name, Column(trace, Quantity::kWork, drive.name),
        force && velocity ? VecX(force->cwiseProduct(*velocity)) : none);
  }
  for (const Prescribed& base : mechanism.prescribed) {
    if (const auto work = Column(trace, Quantity::kBaseWork, base.name)) {
      curves->push_back({base.name, false, *work});
    }
  }
  if (!mechanism.prescribed.empty() && !integrated) {
    add("base motion", {}, Column(trace, Quantity::kBasePower).value_or(none));
  }
  add("loads", Column(trace, Quantity::kLoadWork),
      Column(trace, Quantity::kLoadPower).value_or(none));
  add("dampers", Column(trace, Quantity::kDamperWork),
      Column(trace, Quantity::kDamperPower).value_or(none));
  return integrated;
}

// A base that moves bodies which no drive carries turns over energy of its own, which must not hide
// what the drives do: the energy turned over counts up to what the carried bodies can take in this
// time, or the drives have done. Of the rest the integration of the base's work leaves a share:
// 4e-9 at 1 ms on a vehicle of 1e9 kg that goes to and fro.
struct EnergySize {
  double scale_J = 0.0, leaves_J = 0.0;
};
EnergySize SizeOfEnergy(const ComparisonInput& input, const Trace& trace,
                        const std::vector<Curve>& curves, double turned_over_J) {
  constexpr double kLeft = 1e-8;
  const ForceScale force = ForceScaleOf(input, trace);
  const double least = kShortest * force.length_m * force.force_N;
  if (input.mechanism->prescribed.empty()) return {std::max(turned_over_J, least), 0.0};
  double carried = force.power_W * (trace.time_s.back() - trace.time_s.front());
  for (const Curve& curve : curves) {
    if (input.mechanism->FindDrive(curve.name) < 0) continue;
    carried = std::max(carried, curve.values.cwiseAbs().maxCoeff());
  }
  return {std::max(std::min(turned_over_J, carried), least),
          turned_over_J > carried ? kLeft * turned_over_J : 0.0};
}

// The parts that the drift is proportional to: drift = share · part.
void NameCulprit(const std::vector<Curve>& curves, const VecX& drift, EnergyAudit* audit) {
  const double size = drift.norm();
  double best = kExplained;
  std::vector<std::pair<double, const Curve*>> fits;
  for (const Curve& curve : curves) {
    const double norm2 = curve.values.squaredNorm();
    if (!(norm2 > 0.0)) continue;
    const double left = (drift - drift.dot(curve.values) / norm2 * curve.values).norm() / size;
    fits.emplace_back(left, &curve);
    best = std::min(best, left);
  }
  std::string text;
  for (const auto& [left, curve] : fits) {
    if (left > kExplained || left > kTie * best) continue;
    const double share = drift.dot(curve->values) / curve->values.squaredNorm();
    if (audit->culprit.empty()) {
      audit->culprit = curve->name;
      audit->share = share;
    }
    // Work that is stated too large is energy that is missing.
    const double excess = curve->stored ? share : -share;
    text += fmt::format("{}{} of {} that is {:.2g} % too {}", text.empty() ? "" : " or ",
                        curve->stored ? "a change" : "work", curve->name, 100.0 * std::abs(excess),
                        excess > 0.0 ? "large" : "small");
  }
  audit->text += text.empty() ? "; it follows no single part" : "; it looks like " + text;
}

}  // namespace

std::optional<EnergyAudit> AuditEnergy(const ComparisonInput& input, const Trace& trace,
                                       std::optional<double> limit) {
  const auto kinetic = Column(trace, Quantity::kKineticEnergy);
  const auto gravity = Column(trace, Quantity::kGravityEnergy);
  const auto springs = Column(trace, Quantity::kSpringEnergy);
  const auto n = static_cast<Eigen::Index>(trace.time_s.size());
  if (!kinetic || !gravity || !springs || n < 4) return {};
  std::vector<Curve> curves;
  for (const auto& [name, energy] :
       {std::pair{"kinetic energy", &*kinetic}, std::pair{"gravity", &*gravity},
        std::pair{"springs", &*springs}}) {
    curves.push_back({name, true, (energy->array() - (*energy)[0]).matrix()});
  }
  EnergyAudit audit;
  audit.witness = trace.witness;
  audit.integrated = AddWorks(*input.mechanism, trace, &curves);
  // Work from samples has their error: it is not judged, and nothing is to blame.
  if (!audit.integrated) limit.reset();
  VecX drift = VecX::Zero(n), work = VecX::Zero(n);
  for (const Curve& curve : curves) {
    drift += curve.stored ? curve.values : VecX(-curve.values);
    if (!curve.stored) work += curve.values;
    audit.parts.push_back(
        {curve.name, curve.stored, curve.values[n - 1], curve.values.cwiseAbs().maxCoeff()});
  }
  const EnergySize size =
      SizeOfEnergy(input, trace, curves, std::max(kinetic->maxCoeff(), work.cwiseAbs().maxCoeff()));
  audit.scale_J = drift.allFinite() ? size.scale_J : kNan;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double value = std::max(0.0, std::abs(drift[i]) - size.leaves_J) / audit.scale_J,
                 t_s = trace.time_s[static_cast<size_t>(i)];
    KeepWorst(&audit.drift, value, t_s, "energy");
    if (limit && value > *limit && std::isnan(audit.from_s)) audit.from_s = t_s;
  }
  audit.drift_J = drift.cwiseAbs().maxCoeff();
  audit.end_drift_J = drift[n - 1];
  if (std::isnan(audit.from_s)) return audit;
  audit.text = fmt::format(
      "energy drifts by {:.2g} J, {:.1e} of the energy turned over, from t = {:.4g} s on",
      audit.drift_J, audit.drift.value, audit.from_s);
  NameCulprit(curves, drift, &audit);
  return audit;
}

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
double LargestPhase(const Mechanism& mechanism, const Motion& motion, double from_s, double h) {
  constexpr int kBetween = 4, kMost = 20000;
  const int count = static_cast<int>(std::min<double>(kMost, kBetween * motion.duration_s / h));
  double largest = 0.0;
  for (const Command& command : motion.commands) {
    double rate2 = 0.0, acceleration2 = 0.0, fastest = 0.0;
    for (int i = 0; i <= count; ++i) {
      const Jet jet = Evaluate(command.profile, from_s + h / kBetween * i);
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
  return std::ranges::any_of(trace.events, [&](const MotionEvent& event) {
    return event.jumps() && from <= event.time_s && event.time_s <= to;
  });
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
  if (LargestPhase(*input.mechanism, *input.motion, trace.time_s[0],
                   trace.time_s[1] - trace.time_s[0]) > kHidden) {
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
    if (LargestPhase(*input.mechanism, *input.motion, trace.time_s[0], h) <= kTwelvePerOscillation)
      return "";
    return "the samples are too far apart for a motion so fast";
  }
  WitnessMetrics metrics;
  if (measured == nullptr) MeasureDerivatives(input, trace, &metrics);
  const std::string& gap = (measured == nullptr ? &metrics : measured)->derivatives_gap;
  if (!gap.empty()) return gap;
  return UnresolvedForces(input, trace);
}

namespace {

// What a coordinate and its rates are recorded as.
struct Recorded {
  Quantity drive, output, joint;
};
constexpr Recorded kValue{Quantity::kPosition, Quantity::kPose, Quantity::kJointPosition};
constexpr Recorded kRate{Quantity::kVelocity, Quantity::kPoseVelocity, Quantity::kJointVelocity};
constexpr Recorded kRate2{Quantity::kAcceleration, Quantity::kPoseAcceleration,
                          Quantity::kJointAcceleration};

// -1 where it is not recorded.
int ColumnOf(const Mechanism& mechanism, const Coordinate& coordinate, const Recorded& as,
             const Trace& trace) {
  const auto index = static_cast<size_t>(coordinate.index);
  switch (coordinate.kind) {
    case Coordinate::Kind::kDrive:
      return trace.Find(as.drive, mechanism.drives[index].name);
    case Coordinate::Kind::kOutput:
      return trace.Find(as.output, mechanism.outputs[index].name, coordinate.component);
    case Coordinate::Kind::kJoint:
      return trace.Find(as.joint, NameOf(mechanism, coordinate));
    case Coordinate::Kind::kPrescribed:
      return -1;
  }
  return -1;
}

// Columns of all terms of a command, or nothing if one of them is not recorded.
std::optional<std::vector<int>> ColumnsOf(const Mechanism& mechanism, const Command& command,
                                          const Trace& trace, const Recorded& as = kValue) {
  std::vector<int> columns;
  for (const Command::Term& term : command.terms) {
    columns.push_back(ColumnOf(mechanism, term.coordinate, as, trace));
    if (columns.back() < 0) return {};
  }
  return columns;
}

// Σ factor · channel in one row.
double ValueOf(const Trace& trace, const Command& command, const std::vector<int>& columns,
               Eigen::Index row) {
  double value = 0.0;
  for (size_t k = 0; k < columns.size(); ++k) {
    value += command.terms[k].factor * trace.values(row, columns[k]);
  }
  return value;
}

void MeasureCommands(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  for (const Command& command : input.motion->commands) {
    const auto columns = ColumnsOf(*input.mechanism, command, trace);
    if (!columns || columns->empty()) continue;
    const bool angle = trace.channels[static_cast<size_t>(columns->front())].unit == "rad";
    const Metric metric = angle ? Metric::kCommandRad : Metric::kCommandM;
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const double value = ValueOf(trace, command, *columns, static_cast<Eigen::Index>(i));
      const double wanted = Evaluate(command.profile, trace.time_s[i]).value;
      const double error = angle ? AngleDifference(value, wanted) : value - wanted;
      KeepWorst(&out->metrics[metric], std::abs(error), trace.time_s[i], command.name);
    }
  }
}

// Rates or accelerations of commanded outputs and passive joints against their commands, pooled per
// unit. A command that holds still is judged by what counts as rest beside the drives' motion.
void MeasureCommandRates(const ComparisonInput& input, const Trace& trace, Metric metric,
                         WitnessMetrics* out) {
  const bool velocity = metric == Metric::kCommandVelocity;
  std::map<bool, ErrorSum> sums;  // by angle
  for (const Command& command : input.motion->commands) {
    const Coordinate& first = command.terms.front().coordinate;
    if (!IsOfTask(first)) continue;
    const auto columns = ColumnsOf(*input.mechanism, command, trace, velocity ? kRate : kRate2);
    if (!columns) continue;
    ErrorSum& sum = sums[!IsLength(*input.mechanism, first)];
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const Jet jet = Evaluate(command.profile, trace.time_s[i]);
      const double wanted = velocity ? jet.rate : jet.acceleration;
      const double value = ValueOf(trace, command, *columns, static_cast<Eigen::Index>(i));
      sum.Add(value - wanted, wanted, trace.time_s[i], command.name);
    }
  }
  for (const auto& [angle, sum] : sums) {
    const RestFloor rest = RestFloorOf(input, angle ? "rad" : "m", trace);
    KeepWorst(&out->metrics[metric],
              sum.MeasuredNrmse(velocity ? rest.velocity : rest.acceleration));
  }
}

// The start of a free motion against the given start values.
void MeasureStart(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  if (trace.time_s.empty() || trace.time_s.front() != 0.0) return;
  for (const InitialValue& value : input.motion->initial) {
    const int column = ColumnOf(*input.mechanism, value.coordinate, kValue, trace);
    if (column < 0) continue;
    const bool angle = trace.channels[static_cast<size_t>(column)].unit == "rad";
    const double error = angle ? AngleDifference(trace.values(0, column), value.position)
                               : trace.values(0, column) - value.position;
    KeepWorst(&out->metrics[angle ? Metric::kCommandRad : Metric::kCommandM], std::abs(error), 0.0,
              value.name);
  }
}

void MeasureClosure(const Trace& trace, WitnessMetrics* out) {
  for (const auto& [quantity, metric] : {std::pair{Quantity::kLoopGap, Metric::kClosureM},
                                         std::pair{Quantity::kLoopTwist, Metric::kClosureRad}}) {
    const std::string name = ChannelName(quantity);
    const int column = trace.Find(name);
    if (column < 0) continue;
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      KeepWorst(&out->metrics[metric], std::abs(trace.values(static_cast<Eigen::Index>(i), column)),
                trace.time_s[i], name);
    }
  }
}

// Input without the word of the witness for it: what the recorded forces do at the recorded
// velocities. Nothing where the trace lacks a part.
std::optional<VecX> InputOf(const Mechanism& mechanism, const Trace& trace) {
  VecX input = VecX::Zero(trace.values.rows());
  for (const Drive& drive : mechanism.drives) {
    const int force = trace.Find(Quantity::kForce, drive.name);
    const int velocity = trace.Find(Quantity::kVelocity, drive.name);
    if (force < 0 || velocity < 0) return {};
    input += trace.values.col(force).cwiseProduct(trace.values.col(velocity));
  }
  for (const Quantity part : {Quantity::kBasePower, Quantity::kLoadPower, Quantity::kDamperPower}) {
    const int column = trace.Find(part);
    if (column < 0) return {};
    input += trace.values.col(column);
  }
  return input;
}

// Where power flows within the mechanism and little comes in, the flow is the scale: what gravity
// and springs exchange with the motion, and the kinetic energy per duration. A base that moves
// bodies which no drive carries has power of its own, which must not hide what the drives do: flows
// count up to what the carried bodies can take.
struct PowerSize {
  double scale = 0.0;     // of the balance [W]
  double roundoff = 0.0;  // that the base's power leaves
};
PowerSize SizeOfPower(const ComparisonInput& input, const Trace& trace) {
  constexpr double kRoundings = 16.0;
  const ForceScale force = ForceScaleOf(input, trace);
  const auto largest = [&](Quantity quantity, const std::string& subject = "") {
    const int column = trace.Find(quantity, subject);
    return column < 0 ? 0.0 : trace.values.col(column).cwiseAbs().maxCoeff();
  };
  double flow = 0.0;
  for (const Quantity power :
       {Quantity::kInputPower, Quantity::kEnergyRate, Quantity::kBasePower, Quantity::kLoadPower,
        Quantity::kDamperPower, Quantity::kGravityPower, Quantity::kSpringPower}) {
    flow = std::max(flow, largest(power));
  }
  const double duration_s = trace.time_s.back() - trace.time_s.front();
  if (duration_s > 0.0) flow = std::max(flow, largest(Quantity::kKineticEnergy) / duration_s);
  // A mechanism at rest has no power: forces count at the speed of rest.
  double scale = RestFloorOf(input, "m").velocity * ForceScale::kIdle * force.force_N;
  double carried = force.power_W;
  for (const Drive& drive : input.mechanism->drives) {
    const double rest = RestFloorOf(input, PositionUnit(*input.mechanism, drive)).velocity;
    const int f = trace.Find(Quantity::kForce, drive.name);
    const int v = trace.Find(Quantity::kVelocity, drive.name);
    scale = std::max(scale, rest * largest(Quantity::kForce, drive.name));
    if (f < 0 || v < 0) continue;
    carried = std::max(carried,
                       trace.values.col(f).cwiseProduct(trace.values.col(v)).cwiseAbs().maxCoeff());
  }
  const bool base = !input.mechanism->prescribed.empty();
  return {std::max(scale, std::min(flow, carried)), base ? kRoundings * kEps * flow : 0.0};
}

void MeasurePower(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  const std::string name = ChannelName(Quantity::kInputPower);
  const int in = trace.Find(name), rate = trace.Find(Quantity::kEnergyRate);
  if (in < 0 || rate < 0 || trace.time_s.empty()) return;
  const PowerSize size = SizeOfPower(input, trace);
  std::vector<VecX> inputs = {trace.values.col(in)};
  if (auto recorded = InputOf(*input.mechanism, trace)) inputs.push_back(*std::move(recorded));
  for (const VecX& power : inputs) {
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const double error = std::abs(power[row] - trace.values(row, rate)) - size.roundoff;
      KeepWorst(&out->metrics[Metric::kPower], error <= 0.0 ? 0.0 : error / size.scale,
                trace.time_s[i], name);
    }
  }
}

// What is used most of motors and their DC link, where a margin is required.
void MeasureMotors(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out) {
  if (!input.limits[Metric::kMotorUse].reference) return;
  Measured* worst = &out->metrics[Metric::kMotorUse];
  const std::vector<MotorLoad> loads = MotorLoadsOf(*input.mechanism, trace, input.drive_facts);
  for (const MotorLoad& load : loads) {
    KeepWorst(worst, load.largest_use(), load.largest_use_time_s(), load.drive);
  }
  if (!input.mechanism->dc_link) return;
  const auto link = LinkLoadOf(*input.mechanism->dc_link, loads);
  const MotorLoad::Use* use = link ? LargestUse(link->uses) : nullptr;
  if (use != nullptr) KeepWorst(worst, use->use, use->time_s, "DC link");
}

}  // namespace

WitnessMetrics MeasureWitness(const ComparisonInput& input, const Trace& trace) {
  WitnessMetrics metrics{.witness = trace.witness};
  MeasureCommands(input, trace, &metrics);
  // A table follows a motion; it has no bodies, and its digits leave no derivatives to check.
  if (input.table != nullptr && trace.witness == role::kReference) return metrics;
  MeasureCommandRates(input, trace, Metric::kCommandVelocity, &metrics);
  MeasureCommandRates(input, trace, Metric::kCommandAcceleration, &metrics);
  MeasureClosure(trace, &metrics);
  MeasurePower(input, trace, &metrics);
  MeasureMotors(input, trace, &metrics);
  if (input.motion->free()) MeasureStart(input, trace, &metrics);
  const bool engine = IsEngine(trace.witness);
  const LimitColumn column = engine ? input.simulation_limits : LimitColumn::kReference;
  // What a payload brings along and takes away is no drive's work.
  if (!HasPayloads(*input.motion)) {
    metrics.energy = AuditEnergy(input, trace, input.limits[Metric::kEnergy].Of(column));
  }
  // Work from samples has their error; only integrated work is judged.
  if (metrics.energy && metrics.energy->integrated) {
    metrics.metrics[Metric::kEnergy] = metrics.energy->drift;
  }
  // An integrated velocity carries the integrator's error; only computed ones are checked.
  if (!engine) MeasureDerivatives(input, trace, &metrics);
  return metrics;
}

}  // namespace mbv
