// Which witness is the odd one out, and what the difference looks like.
//
// Evidence is taken in this order:
//   1. motion: rates that are no derivatives, drive motion that leads elsewhere than commanded
//      (attribution_kinematics.cc). Wrong motion makes wrong forces, so it is looked at first;
//   2. the two that are closest by far stand against the third;
//   3. of two that differ, the one whose own energy drifts (attribution_energy.cc).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "comparison/attribution_parts.h"
#include "comparison/driven.h"
#include "comparison/metrics.h"
#include "comparison/verdict.h"

namespace mbv {
namespace {

using internal::Amount;
using internal::AmountOf;
using internal::Failed;
using internal::NameOf;
using internal::Place;

// What a wrong force looks like: opposite sign or a constant factor.
std::string Hint(const PairComparison& pair) {
  constexpr double kLooksConstant = 1e-3;
  for (const DriveMetrics& drive : pair.drives) {
    if (!(drive.factor_residual < kLooksConstant * std::abs(drive.factor - 1.0))) continue;
    if (std::abs(drive.factor + 1.0) < kLooksConstant) {
      return fmt::format("; {} has the opposite sign throughout", drive.drive);
    }
    return fmt::format(
        "; the ratio at {} is constant ({:.6g}): look for a factor, a mass or a unit", drive.drive,
        drive.factor);
  }
  return "";
}

// The metric to judge three pairs by: forces if they fail, else what fails worst.
const CheckResult* WorstPairCheck(const Comparison& comparison) {
  const CheckResult* worst = nullptr;
  double worst_ratio = -1.0;
  for (const CheckResult& check : comparison.checks) {
    if (!Failed(&check) || !RowOf(check.metric).of_pair) continue;
    const bool force = IsDriveForce(check.metric);
    double ratio = std::isnan(check.value) ? 1e300 : check.value / *check.limit;
    if (force) ratio += 1e301;
    if (ratio > worst_ratio) {
      worst = &check;
      worst_ratio = ratio;
    }
  }
  return worst;
}

// What a failed check of a pair is measured by in all pairs.
struct Yardstick {
  std::string title;  // "drive force, RMS"
  std::string unit;   // "" for a ratio
  Metric metric = Metric::kForceNrmse;
  std::string column = {};  // of a table; "" measures the metric itself
};

struct Distance : PairDistance {
  Distance(const PairComparison& of, Measured by)
      : PairDistance{of.measured, of.truth, by.value}, pair(&of), where(std::move(by)) {}

  const PairComparison* pair;
  Measured where;
};

const Trace* TraceOf(const ComparisonInput& input, const std::string& witness) {
  for (const Witness& w : input.witnesses) {
    if (w.name == witness && w.trace != nullptr && w.summary.ok()) return w.trace;
  }
  return nullptr;
}

// RMS difference of one signal in two traces [unit].
std::optional<Measured> SignalDistance(const ComparisonInput& input, const PairComparison& pair,
                                       const std::string& channel) {
  const Trace* a = TraceOf(input, pair.measured);
  const Trace* b = TraceOf(input, pair.truth);
  if (a == nullptr || b == nullptr) return {};
  const int i = a->Find(channel), j = b->Find(channel);
  if (i < 0 || j < 0) return {};
  const bool angle = a->channels[static_cast<size_t>(i)].unit == "rad";
  ErrorSum sum;
  for (const auto& [k, l] : AlignSamples(*a, *b)) {
    const double time_s = a->time_s[static_cast<size_t>(k)];
    if (time_s < input.start_window_s) continue;
    const double x = a->values(k, i), y = b->values(l, j);
    sum.Add(angle ? AngleDifference(x, y) : x - y, y, time_s, channel);
  }
  if (sum.count() == 0) return {};
  return Measured{sum.rms_error(), sum.worst_time_s(), channel};
}

// The compared pairs by increasing distance; NaN counts as farthest.
std::vector<Distance> Distances(const ComparisonInput& input, const Comparison& comparison,
                                const Yardstick& yardstick) {
  std::vector<Distance> distances;
  for (const PairComparison& pair : comparison.pairs) {
    if (!yardstick.column.empty()) {
      const auto distance = SignalDistance(input, pair, yardstick.column);
      if (distance) distances.emplace_back(pair, *distance);
      continue;
    }
    const auto found = pair.metrics.find(yardstick.metric);
    if (pair.compared && found != pair.metrics.end()) distances.emplace_back(pair, found->second);
  }
  SortByDistance(&distances);
  return distances;
}

// A column of a table is measured in its own unit: how often it leaves its tube says nothing about
// two computations that have none.
Yardstick YardstickOf(const ComparisonInput& input, const CheckResult& check) {
  Yardstick yardstick{
      .title = RowOf(check.metric).title, .unit = RowOf(check.metric).unit, .metric = check.metric};
  if (check.metric != Metric::kTableTube || input.table == nullptr) return yardstick;
  const int column = input.table->trace.Find(check.channel);
  if (column < 0) return yardstick;
  yardstick.column = check.channel;
  yardstick.unit = input.table->trace.channels[static_cast<size_t>(column)].unit;
  yardstick.title = check.channel + ", RMS";
  return yardstick;
}

// Why two computations that differ do not tell which of them is wrong, or that they do.
Attribution WhyUndecided(const ComparisonInput& input, const Comparison& comparison,
                         const CheckResult& check, bool third) {
  const PairComparison& pair = *comparison.FindPair(check.subject);
  if (check.follows && IsEngine(pair.measured) && pair.truth == input.driven_by) {
    if (third) return {pair.measured, "the simulation does not follow the motion that it is given"};
    return {"",
            "either the simulation does not follow the motion that it is given, or that motion "
            "contradicts itself"};
  }
  if (!third) {
    Attribution energy = internal::AttributeByEnergy(comparison, pair);
    if (!energy.text.empty()) return energy;
    return {"", "a third witness would tell which one is wrong" + internal::EnergyHint(comparison)};
  }
  return {"", fmt::format("the simulation follows the {} drive motion and cannot tell which is "
                          "wrong",
                          input.driven_by)};
}

// Two computations only, or drive motion that one of them took from another.
Attribution TwoDiffer(const ComparisonInput& input, const Comparison& comparison,
                      const CheckResult& check, bool third) {
  const PairComparison& pair = *comparison.FindPair(check.subject);
  Attribution attribution = WhyUndecided(input, comparison, check, third);
  attribution.text = fmt::format("{} and {} differ by {} in {}: worst at {}{}; {}",
                                 NameOf(comparison, pair.measured), NameOf(comparison, pair.truth),
                                 AmountOf(check), RowOf(check.metric).title,
                                 Place(check.channel, check.time_s), Hint(pair), attribution.text);
  return attribution;
}

// 2. Two against one.
Attribution ByDistance(const ComparisonInput& input, const Comparison& comparison) {
  const CheckResult* check = WorstPairCheck(comparison);
  if (check == nullptr) return {};
  const Yardstick yardstick = YardstickOf(input, *check);
  const auto amount = [&](const Distance& d) { return Amount(d.value, yardstick.unit); };
  const std::vector<Distance> distances = Distances(input, comparison, yardstick);
  const bool followed = IsDriveMotion(check->metric) && !input.motion->free();
  if (distances.size() < 3 || followed) {
    return TwoDiffer(input, comparison, *check, distances.size() >= 3);
  }
  const Distance& near = distances[0];
  const std::string odd = OddOneOut(distances);
  const Distance& far = odd.empty() ? distances[1] : *NearestOf(odd, distances);
  if (odd.empty() && distances.size() > 3) {
    std::string all;
    for (const Distance& d : distances) all += fmt::format(", {} {}", d.pair->name(), amount(d));
    return {"", fmt::format("no witness stands clearly alone ({}{})", yardstick.title, all)};
  }
  if (odd.empty()) {
    return {"", fmt::format("no two witnesses stand clearly against the third: {} {}, {} {}, {} {} "
                            "({})",
                            near.pair->name(), amount(near), far.pair->name(), amount(far),
                            distances[2].pair->name(), amount(distances[2]), yardstick.title)};
  }
  const std::string tube = yardstick.column.empty() ? "" : " (" + AmountOf(*check) + ")";
  return {odd,
          fmt::format("{} and {} agree to {}, {} differs by {} in {}{}: worst at {}{}",
                      NameOf(comparison, near.pair->measured), NameOf(comparison, near.pair->truth),
                      amount(near), NameOf(comparison, odd), amount(far), yardstick.title, tube,
                      Place(far.where.channel, far.where.time_s), Hint(*far.pair))};
}

// 4. A check of the simulation alone (loop gap, power) that fails while all pairs agree.
Attribution BySingleCheck(const Comparison& comparison) {
  for (const CheckResult& check : comparison.checks) {
    if (!Failed(&check) || RowOf(check.metric).of_pair) continue;
    if (check.metric == Metric::kMotorUse) {
      return {"", fmt::format("by {}, the motor of {} has a margin of {:.3g} where {:.3g} is "
                              "required: the witnesses do not disagree about that",
                              NameOf(comparison, check.subject), check.channel, 1.0 / check.value,
                              1.0 / *check.limit)};
    }
    return {check.subject, fmt::format("{}: {} is {} at {}", NameOf(comparison, check.subject),
                                       RowOf(check.metric).title, AmountOf(check),
                                       Place(check.channel, check.time_s))};
  }
  return {};
}

std::string AgreementText(const ComparisonInput& input, const Comparison& comparison) {
  std::string text;
  // A free motion has no drive force to compare.
  for (const Metric metric :
       {Metric::kForceNrmse, Metric::kPoseM, Metric::kPositionM, Metric::kPositionRad}) {
    const Yardstick yardstick{.title = "", .unit = RowOf(metric).unit, .metric = metric};
    for (const Distance& distance : Distances(input, comparison, yardstick)) {
      text += fmt::format("{}{} and {} agree to {}", text.empty() ? "" : ", ",
                          NameOf(comparison, distance.pair->measured),
                          NameOf(comparison, distance.pair->truth),
                          Amount(distance.value, yardstick.unit));
    }
    if (!text.empty()) break;
  }
  return text;
}

// What a disagreement comes from: motion first, then forces. Motion that only the simulation gets
// wrong (its own error) does not hide that another witness' forces are wrong by far.
Attribution OfDisagreement(const ComparisonInput& input, const Comparison& comparison) {
  const Attribution motion = internal::AttributeByKinematics(input, comparison);
  if (motion.text.empty()) {
    Attribution found = ByDistance(input, comparison);
    if (found.text.empty()) found = BySingleCheck(comparison);
    const bool said = found.text.find("step_s") != std::string::npos;
    if (found.odd_one_out == role::kSimulated && !said)
      found.text += internal::EnergyHint(comparison);
    return found;
  }
  if (!IsEngine(motion.odd_one_out)) return motion;
  const Attribution distance = ByDistance(input, comparison);
  if (distance.odd_one_out.empty() || distance.odd_one_out == motion.odd_one_out) return motion;
  return {distance.odd_one_out, distance.text + "; besides, " + motion.text};
}

}  // namespace

namespace internal {

std::string Amount(double value, const std::string& unit) {
  if (!unit.empty()) return fmt::format("{:.2g} {}", value, unit);
  if (value >= 10.0) return fmt::format("{:.2g} times", value);
  if (value >= 1.0) return fmt::format("{:.0f} %", 100.0 * value);
  if (value >= 1e-3) return fmt::format("{:.2g} %", 100.0 * value);
  return fmt::format("{:.1e}", value);
}

std::string AmountOf(const CheckResult& check) {
  if (check.metric == Metric::kTableTube)
    return fmt::format("{:.2g} times its tolerance", check.value);
  return Amount(check.value, RowOf(check.metric).unit);
}

std::string Place(const std::string& channel, double time_s) {
  return fmt::format("{}, t = {:.4g} s", channel, time_s);
}

std::string NameOf(const Comparison& comparison, const std::string& witness) {
  if (witness == role::kReference && comparison.table) return "the table " + comparison.table->name;
  const Role* role = FindRole(witness);
  return role == nullptr ? witness : role->called;
}

bool Failed(const CheckResult* check) { return check != nullptr && check->limit && !check->pass; }

}  // namespace internal

Attribution Attribute(const ComparisonInput& input, const Comparison& comparison) {
  if (comparison.verdict == Verdict::kNotRun) return {};
  const Attribution driven = AttributeDriven(input, comparison);
  if (comparison.verdict == Verdict::kAgree) {
    return driven.text.empty() ? Attribution{"", AgreementText(input, comparison)} : driven;
  }
  Attribution attribution = driven.text.empty() ? OfDisagreement(input, comparison) : driven;
  if (comparison.table) {
    for (const std::string& diagnosis : comparison.table->diagnoses) {
      attribution.text += (attribution.text.empty() ? "" : "; ") + diagnosis;
    }
  }
  return attribution;
}

}  // namespace mbv
