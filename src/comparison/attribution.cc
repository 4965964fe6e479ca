// Which witness is the odd one out, and what the difference looks like.
//
// The simulation follows the drive motion of one other witness, so their agreement on motion is no
// evidence. Evidence is taken in this order:
//   1. a witness whose drive rates are not the derivatives of its drive positions is wrong;
//   2. a mechanism that misses the commanded pose tells of wrong drive motion, or of a wrong model
//      if two witnesses agree on that motion;
//   3. otherwise the two that are closest by far stand against the third.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "comparison/comparison.h"
#include "comparison/driven.h"

namespace mbv {
namespace {

// The third witness must be this much farther from the other two than they are from each other.
constexpr double kClearlyFarther = 10.0;

std::string Amount(double value, const char* unit) {
  if (*unit != '\0') return fmt::format("{:.2g} {}", value, unit);
  if (value >= 1e-3) return fmt::format("{:.2g} %", 100.0 * value);
  return fmt::format("{:.1e}", value);
}

std::string Place(const std::string& channel, double time_s) {
  return fmt::format("{}, t = {:.4g} s", channel, time_s);
}

std::string AmountOf(const CheckResult& check) {
  return Amount(check.value, RowOf(check.metric).unit);
}

bool Failed(const CheckResult* check) { return check != nullptr && check->limit && !check->pass; }

// A failed command check of a witness, metres before radians.
const CheckResult* FailedCommand(const Comparison& comparison, const std::string& witness) {
  for (const char* key : {".command_m", ".command_rad"}) {
    const CheckResult* check = comparison.FindCheck(witness + key);
    if (Failed(check)) return check;
  }
  return nullptr;
}

bool PositionsDiffer(const Comparison& comparison, const std::string& pair) {
  return Failed(comparison.FindCheck(pair + ".position_m")) ||
         Failed(comparison.FindCheck(pair + ".position_rad"));
}

// 1. Rates against differences of positions.
Attribution ByDerivatives(const Comparison& comparison) {
  for (const char* name : {"analytic", "reference", "solver"}) {
    const CheckResult* check = comparison.FindCheck(std::string(name) + ".derivatives");
    if (!Failed(check)) continue;
    return {name, fmt::format("{}: its drive rates are not the time derivatives of its drive "
                              "positions; they differ by {} at {}",
                              name, AmountOf(*check), Place(check->channel, check->time_s))};
  }
  return {};
}

// 2. The commanded pose.
Attribution ByCommand(const ComparisonInput& input, const Comparison& comparison) {
  if (const CheckResult* check = FailedCommand(comparison, "reference");
      check != nullptr && comparison.table) {
    return {"reference", fmt::format("the table {} does not follow the commanded motion: {} off "
                                     "at {}; does it belong to another motion?",
                                     comparison.table->name, AmountOf(*check),
                                     Place(check->channel, check->time_s))};
  }
  if (const CheckResult* check = FailedCommand(comparison, "reference")) {
    return {"reference", fmt::format("the reference misses the commanded motion by {} at {}",
                                     AmountOf(*check), Place(check->channel, check->time_s))};
  }
  const CheckResult* check = FailedCommand(comparison, "simulated");
  if (check == nullptr) return {};
  const std::string miss = fmt::format("misses the commanded motion by {} at {}", AmountOf(*check),
                                       Place(check->channel, check->time_s));
  const PairComparison* kinematics = comparison.FindPair("reference_vs_analytic");
  if (input.driven_by != "analytic" || kinematics == nullptr || !kinematics->compared ||
      comparison.table) {
    return {"", fmt::format("the simulation, driven by the {} drive motion, {}; either that drive "
                            "motion or the simulated model is wrong, and there is no third "
                            "witness to tell",
                            input.driven_by, miss)};
  }
  if (!PositionsDiffer(comparison, "reference_vs_analytic")) {
    return {"simulated", fmt::format("analytic and reference agree on the drive motion, but under "
                                     "it the simulation {}",
                                     miss)};
  }
  const bool lengths = Failed(comparison.FindCheck("reference_vs_analytic.position_m"));
  const CheckResult& drive = *comparison.FindCheck(lengths ? "reference_vs_analytic.position_m"
                                                           : "reference_vs_analytic.position_rad");
  return {"analytic",
          fmt::format("under the analytic drive motion the simulation {}; the reference, which "
                      "meets the command, needs drive positions that differ by {} (worst at {})",
                      miss, AmountOf(drive), Place(drive.channel, drive.time_s))};
}

std::string NameOf(const Comparison& comparison, const std::string& witness) {
  if (witness == "simulated") return "simulation";
  if (witness == "reference" && comparison.table) return "the table " + comparison.table->name;
  return witness == "solver" ? "the generic solver" : witness;
}

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

struct Distance {
  const PairComparison* pair;
  Measured measured;
};

// The compared pairs by increasing distance in one metric; NaN counts as farthest.
std::vector<Distance> Distances(const Comparison& comparison, Metric metric) {
  std::vector<Distance> distances;
  for (const PairComparison& pair : comparison.pairs) {
    const auto found = pair.metrics.find(metric);
    if (pair.compared && found != pair.metrics.end()) distances.push_back({&pair, found->second});
  }
  const auto key = [](const Distance& d) {
    return std::isnan(d.measured.value) ? 1e300 : d.measured.value;
  };
  std::stable_sort(distances.begin(), distances.end(),
                   [&](const Distance& a, const Distance& b) { return key(a) < key(b); });
  return distances;
}

bool IsDriveMotion(Metric metric) {
  return metric == Metric::kPositionM || metric == Metric::kPositionRad ||
         metric == Metric::kVelocity || metric == Metric::kAcceleration;
}

// The witness of the compared pairs that is not in this one.
std::string ThirdOf(const std::vector<Distance>& distances, const PairComparison& pair) {
  for (const Distance& distance : distances) {
    for (const std::string& name : {distance.pair->measured, distance.pair->truth}) {
      if (pair.measured != name && pair.truth != name) return name;
    }
  }
  return "";
}

// 3. Two against one.
Attribution ByDistance(const ComparisonInput& input, const Comparison& comparison) {
  const CheckResult* check = WorstPairCheck(comparison);
  if (check == nullptr) return {};
  const MetricRow& row = RowOf(check->metric);
  const std::vector<Distance> distances = Distances(comparison, check->metric);
  if (distances.size() < 3 || IsDriveMotion(check->metric)) {
    const PairComparison& pair = *comparison.FindPair(check->subject);
    std::string why = distances.size() < 3 ? "a third witness would tell which one is wrong"
                                           : fmt::format(
                                                 "the simulation follows the {} drive "
                                                 "motion and cannot tell which is wrong",
                                                 input.driven_by);
    return {"", fmt::format("{} and {} differ by {} in {}: worst at {}{}; {}",
                            NameOf(comparison, pair.measured), NameOf(comparison, pair.truth),
                            AmountOf(*check), row.title, Place(check->channel, check->time_s),
                            Hint(pair), why)};
  }
  const Distance &near = distances[0], &far = distances[1];
  if (!(far.measured.value >= kClearlyFarther * near.measured.value ||
        std::isnan(far.measured.value))) {
    return {"",
            fmt::format("no two witnesses stand clearly against the third: {} {}, {} {}, {} {} "
                        "({})",
                        near.pair->name(), Amount(near.measured.value, row.unit), far.pair->name(),
                        Amount(far.measured.value, row.unit), distances[2].pair->name(),
                        Amount(distances[2].measured.value, row.unit), row.title)};
  }
  const std::string odd = ThirdOf(distances, *near.pair);
  return {odd,
          fmt::format("{} and {} agree to {}, {} differs by {} in {}: worst at {}{}",
                      NameOf(comparison, near.pair->measured), NameOf(comparison, near.pair->truth),
                      Amount(near.measured.value, row.unit), NameOf(comparison, odd),
                      Amount(far.measured.value, row.unit), row.title,
                      Place(far.measured.channel, far.measured.time_s), Hint(*far.pair))};
}

// 4. A check of the simulation alone (loop gap, power) that fails while all pairs agree.
Attribution BySingleCheck(const Comparison& comparison) {
  for (const CheckResult& check : comparison.checks) {
    if (!Failed(&check) || RowOf(check.metric).of_pair) continue;
    return {check.subject, fmt::format("{}: {} is {} at {}", NameOf(comparison, check.subject),
                                       RowOf(check.metric).title, AmountOf(check),
                                       Place(check.channel, check.time_s))};
  }
  return {};
}

std::string AgreementText(const Comparison& comparison) {
  std::string text;
  // A free motion has no drive force to compare.
  for (const Metric metric :
       {Metric::kForceNrmse, Metric::kPoseM, Metric::kPositionM, Metric::kPositionRad}) {
    for (const Distance& distance : Distances(comparison, metric)) {
      text += fmt::format("{}{} and {} agree to {}", text.empty() ? "" : ", ",
                          NameOf(comparison, distance.pair->measured),
                          NameOf(comparison, distance.pair->truth),
                          Amount(distance.measured.value, RowOf(metric).unit));
    }
    if (!text.empty()) break;
  }
  return text;
}

}  // namespace

Attribution Attribute(const ComparisonInput& input, const Comparison& comparison) {
  if (comparison.verdict == Verdict::kNotRun) return {};
  const Attribution driven = AttributeDriven(input, comparison);
  if (comparison.verdict == Verdict::kAgree) {
    return driven.text.empty() ? Attribution{"", AgreementText(comparison)} : driven;
  }
  Attribution attribution = ByDerivatives(comparison);
  if (attribution.text.empty()) attribution = driven;
  if (attribution.text.empty()) attribution = ByCommand(input, comparison);
  if (attribution.text.empty()) attribution = ByDistance(input, comparison);
  if (attribution.text.empty()) attribution = BySingleCheck(comparison);
  if (comparison.table) {
    for (const std::string& diagnosis : comparison.table->diagnoses) {
      attribution.text += (attribution.text.empty() ? "" : "; ") + diagnosis;
    }
  }
  return attribution;
}

}  // namespace mbv
