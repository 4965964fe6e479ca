#include "comparison/driven.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/attribution_parts.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

using internal::Failed;

bool IsMotion(Metric metric) {
  return IsTrajectory(metric) || metric == Metric::kVelocity || metric == Metric::kAcceleration ||
         metric == Metric::kReaction || metric == Metric::kReactionOwn ||
         metric == Metric::kBaseForce;
}

std::string Amount(const CheckResult& check) {
  const char* unit = RowOf(check.metric).unit;
  return fmt::format("{:.1e}{}{}", check.value, *unit == '\0' ? "" : " ", unit);
}

// The simulation's check of lengths and angles that is worst against its limit.
const CheckResult* WorstMotion(const Comparison& comparison) {
  const CheckResult* worst = nullptr;
  double most = -1.0;
  for (const CheckResult& check : comparison.checks) {
    if (!IsEngine(check.measured) || check.truth == role::kReached) continue;
    const bool place = IsTrajectory(check.metric) || check.metric == Metric::kCommandM ||
                       check.metric == Metric::kCommandRad;
    if (!check.limit || !place) continue;
    const double ratio = std::isnan(check.value) ? 1e300 : check.value / *check.limit;
    if (ratio <= most) continue;
    worst = &check;
    most = ratio;
  }
  return worst;
}

std::string Astray(const ComparisonInput& input, const CheckResult& check) {
  const char* unit = RowOf(check.metric).unit;
  return fmt::format("forces bent by {:.0e} would lead it {:.1e} {} astray", input.bend,
                     *check.limit, unit);
}

Attribution AttributePushed(const ComparisonInput& input, const Comparison& comparison) {
  const CheckResult* worst = WorstMotion(comparison);
  if (worst == nullptr || (worst->pass && comparison.verdict != Verdict::kAgree)) return {};
  if (worst->pass) {
    return {"", fmt::format("pushed by the {} forces in open loop for {:g} s, the simulation stays "
                            "within {} of the commanded motion; {}",
                            input.driven_by, input.motion->duration_s, Amount(*worst),
                            Astray(input, *worst))};
  }
  const std::string leaves = fmt::format(
      "pushed by the {} forces, the simulation leaves the commanded motion by {} at "
      "{}, t = {:.4g} s; {}",
      input.driven_by, Amount(*worst), worst->channel, worst->time_s, Astray(input, *worst));
  const CheckResult* forces =
      comparison.FindCheck(role::kReference, role::kAnalytic, Metric::kForceNrmse);
  if (forces == nullptr) {
    return {"", leaves +
                    "; a third witness would tell whether the forces or the simulated model "
                    "are wrong"};
  }
  if (!Failed(forces)) {
    return {worst->measured,
            fmt::format("analytic and reference agree on the drive forces to {}, but {}",
                        Amount(*forces), leaves)};
  }
  return {input.driven_by == role::kAnalytic ? input.driven_by : "",
          fmt::format("{}; the reference's forces differ from the analytic ones by {}, worst at "
                      "{}, t = {:.4g} s",
                      leaves, Amount(*forces), forces->channel, forces->time_s)};
}

Attribution AttributeServo(const Comparison& comparison) {
  const CheckResult* reached =
      comparison.FindCheck(role::kSimulated, role::kReached, Metric::kForceNrmse);
  const CheckResult* forces =
      comparison.FindCheck(role::kReference, role::kAnalytic, Metric::kForceNrmse);
  if (reached == nullptr) return {};
  if (comparison.verdict != Verdict::kAgree && !Failed(reached) && !Failed(forces)) return {};
  const std::string differ =
      fmt::format("worst at {}, t = {:.4g} s", reached->channel, reached->time_s);
  if (Failed(reached)) {
    const bool sure = forces != nullptr && !Failed(forces);
    return {sure ? reached->measured : "",
            fmt::format(
                "on the motion that the servos reached, the actuator forces differ from "
                "the reference by {}: {}{}",
                Amount(*reached), differ,
                sure ? fmt::format("; analytic and reference agree to {}", Amount(*forces)) : "")};
  }
  const std::string agree =
      fmt::format("on the motion that the servos reached, simulation and reference agree to {}",
                  Amount(*reached));
  if (Failed(forces)) {
    return {forces->truth, fmt::format("{}; analytic differs by {}, worst at {}, t = {:.4g} s",
                                       agree, Amount(*forces), forces->channel, forces->time_s)};
  }
  std::string text = agree;
  for (const Role* truth : {&role::kAnalytic, &role::kReference}) {
    const auto find = [&](Metric metric) {
      return comparison.FindCheck(role::kSimulated, *truth, metric);
    };
    const CheckResult* tracking = find(Metric::kPositionM);
    if (tracking == nullptr) tracking = find(Metric::kPositionRad);
    const CheckResult* cost = find(Metric::kForceNrmse);
    if (tracking == nullptr || cost == nullptr) continue;
    return {"", fmt::format("{}; they follow the command to {}, with forces that differ from the "
                            "commanded motion's by {}",
                            text, Amount(*tracking), Amount(*cost))};
  }
  return {"", text};
}

}  // namespace

bool SharesForces(const ComparisonInput& input, const std::string& measured,
                  const std::string& truth) {
  return input.drive_by == DriveBy::kForces && IsEngine(measured) && truth != role::kReached;
}

LimitColumn ColumnOfPair(const ComparisonInput& input, const std::string& measured,
                         const std::string& truth) {
  for (const Witness& witness : input.witnesses) {
    const bool of_pair = witness.name == measured || witness.name == truth;
    // The looser limits of the two.
    if (of_pair && witness.foreign && witness.foreign->limits != LimitColumn::kReference) {
      return witness.foreign->limits;
    }
  }
  if (!IsEngine(measured)) return LimitColumn::kReference;
  const bool servo = input.drive_by == DriveBy::kServos && truth != role::kReached;
  return servo ? LimitColumn::kServo : input.simulation_limits;
}

std::map<Metric, double> GrowthLimits(const ComparisonInput& input, const Trace& simulated) {
  std::map<Metric, double> limits;
  if (input.drive_by != DriveBy::kForces) return limits;
  PairComparison growth;
  if (input.bent != nullptr) growth = ComparePair(input, *input.bent, simulated);
  for (const MetricRow& row : MetricRows()) {
    if (!IsMotion(row.metric)) continue;
    const auto found = growth.metrics.find(row.metric);
    limits[row.metric] = found == growth.metrics.end() ? kNan : found->second.value;
  }
  return limits;
}

std::map<Metric, double> CommandGrowth(const ComparisonInput& input,
                                       const WitnessMetrics& simulated) {
  std::map<Metric, double> limits;
  if (input.drive_by != DriveBy::kForces) return limits;
  WitnessMetrics bent;
  if (input.bent != nullptr) bent = MeasureWitness(input, *input.bent);
  for (const auto& [metric, measured] : simulated.metrics) {
    if (!IsCommand(metric)) continue;
    const auto found = bent.metrics.find(metric);
    limits[metric] =
        found == bent.metrics.end() ? kNan : std::abs(found->second.value - measured.value);
  }
  return limits;
}

void ApplyOther(const OtherLimits& other, const ComparisonInput& input, CheckResult* check) {
  const auto tube = other.tubes.find(check->metric), growth = other.growth.find(check->metric);
  if (!check->limit) return;
  if (tube != other.tubes.end() && tube->second > *check->limit) {
    check->stated_limit = check->limit;
    check->limit = tube->second;
    check->limit_by = "the table's uncertainty";
  } else if (growth != other.growth.end()) {
    check->stated_limit = check->limit;
    check->limit = growth->second;
    check->limit_by = fmt::format("forces bent by {:.0e}", input.bend);
  }
}

void LeaveOutReachedMotion(PairComparison* pair) {
  if (pair->truth != role::kReached) return;
  for (const Metric metric :
       {Metric::kPositionM, Metric::kPositionRad, Metric::kVelocity, Metric::kAcceleration}) {
    pair->metrics.erase(metric);
  }
}

bool IsEvidence(const ComparisonInput& input, const CheckResult& check) {
  if (!check.limit) return false;
  if (input.motion->free()) return IsTrajectory(check.metric);
  switch (input.drive_by) {
    case DriveBy::kForces:
      return IsTrajectory(check.metric) && check.of_pair() && IsEngine(check.measured);
    case DriveBy::kServos:
      return IsDriveForce(check.metric) && check.truth == role::kReached;
    case DriveBy::kMotion:
      return IsDriveForce(check.metric);
  }
  return false;
}

std::string WhyHorizonTooLong(const ComparisonInput& input, const Comparison& comparison) {
  constexpr double kMost = 1e-2;  // of a radian or of the characteristic length
  if (input.drive_by != DriveBy::kForces) return "";
  if (input.bent == nullptr) return "the run with bent forces failed, so errors have no measure";
  const double length_m = CharacteristicLength(*input.mechanism);
  for (const CheckResult& check : comparison.checks) {
    if (!check.limit || !IsTrajectory(check.metric)) continue;
    if (!check.of_pair() || !IsEngine(check.measured)) continue;
    const double size = *RowOf(check.metric).unit == 'm' ? length_m : 1.0;
    if (!(*check.limit > kMost * size)) continue;  // one that is no number fails its check
    return fmt::format(
        "{:g} s are too long to push this mechanism in open loop: forces bent by "
        "{:.0e} lead it {:.2g} {} astray",
        input.motion->duration_s, input.bend, *check.limit, RowOf(check.metric).unit);
  }
  return "";
}

Attribution AttributeDriven(const ComparisonInput& input, const Comparison& comparison) {
  if (input.motion->free()) return {};
  switch (input.drive_by) {
    case DriveBy::kForces:
      return AttributePushed(input, comparison);
    case DriveBy::kServos:
      return AttributeServo(comparison);
    case DriveBy::kMotion:
      return {};
  }
  return {};
}

}  // namespace mbv
