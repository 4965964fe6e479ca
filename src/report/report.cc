#include "report/report.h"

#include <fmt/format.h>

#include <set>

#include "comparison/verdict.h"

namespace mbv {
namespace {

// Whether a reader wants to see it even if it passes.
bool IsKey(const CheckResult& check) {
  const bool simulated = IsEngine(check.measured);
  switch (check.metric) {
    case Metric::kForceNrmse:
    case Metric::kTableTube:
    case Metric::kMotorUse:
      return true;
    case Metric::kForceMax:
    case Metric::kForceOwn:
    case Metric::kPoseM:
    case Metric::kPoseRad:
      return simulated && check.truth == role::kAnalytic;
    case Metric::kCommandM:
    case Metric::kCommandRad:
    case Metric::kCommandVelocity:
    case Metric::kCommandAcceleration:
    case Metric::kClosureM:
    case Metric::kPower:
      return simulated;
    case Metric::kPositionM:
    case Metric::kPositionRad:
    case Metric::kVelocity:
    case Metric::kAcceleration:
    case Metric::kReaction:
    case Metric::kReactionOwn:
    case Metric::kBaseForce:
    case Metric::kClosureRad:
    case Metric::kDerivatives:
      return false;
    case Metric::kEnergy:
      return simulated;
  }
  return true;
}

}  // namespace

const PairComparison* MainPair(const Comparison& comparison) {
  return MainPairOf(comparison.pairs);
}

std::string AtRestText(const Comparison& comparison) {
  const PairComparison* pair = MainPair(comparison);
  if (pair == nullptr || pair->samples_at_rest == 0) return "";
  return fmt::format(
      "friction rests at {} of {} samples: forces are bands there, compared by their ends; RMS "
      "forces count the middle",
      pair->samples_at_rest, pair->force_samples);
}

std::string EngineComparison::FrictionText() const {
  if (friction.empty()) return "";
  const FrictionError& first = friction.front();
  if (!first.failure.empty()) return "MuJoCo's own frictionloss: no result: " + first.failure;
  const auto of = [](const FrictionError& e) {
    const std::string unit = e.unit.empty() ? "" : " " + e.unit;
    return fmt::format("{:.2g}{} in {} with a step of {:g} ms", e.value, unit, e.check,
                       1e3 * e.step_s);
  };
  std::string text =
      fmt::format("MuJoCo's own frictionloss{} is off by {}",
                  coulomb_alone ? " (of coulomb alone: it has no breakaway)" : "", of(first));
  text += fmt::format(" (limit {:.1g})", first.limit);
  if (first.within()) return text;
  for (const FrictionError& e : friction) {
    if (e.within()) return text + fmt::format("; {:g} ms brings it below", 1e3 * e.step_s);
  }
  const FrictionError& last = friction.back();
  if (friction.size() == 1) return text + "; no smaller step was tried";
  if (!last.failure.empty())
    return text + "; no smaller step that was tried helps: " + last.failure;
  return text + "; no step that was tried brings it below: still " + of(last);
}

const char* EngineComparison::NameOf(const std::string& engine) {
  if (engine == "defaults") return "MuJoCo, default softness, position targets";
  if (engine == "stock") return "MuJoCo, best recipe from outside";
  return "with the corrections";
}

std::vector<SignalSheet> SheetsOf(const Mechanism& mechanism, const Comparison& comparison) {
  std::vector<SignalSheet> sheets;
  for (const Drive& drive : mechanism.drives) sheets.push_back(SheetOf(mechanism, drive));
  std::set<std::string> compared;
  for (const PairComparison& pair : comparison.pairs) {
    compared.insert(pair.reactions.begin(), pair.reactions.end());
  }
  for (const Joint& joint : mechanism.joints) {
    if (compared.contains(joint.name)) sheets.push_back(SheetOf(mechanism, joint));
  }
  return sheets;
}

ResultView ViewOf(const Report& report) {
  const Comparison& comparison = report.comparison;
  ResultView view = ViewOfComparison(report, comparison);
  view.caveats = comparison.caveats;
  for (const CheckResult& check : comparison.checks) {
    const MetricRow& row = RowOf(check.metric);
    view.checks.push_back(
        {.name = check.name,
         .subject = check.subject,
         .title = *row.unit == '\0' ? row.title : fmt::format("{} [{}]", row.title, row.unit),
         .value = check.value,
         .limit = check.limit,
         .pass = check.pass,
         .where = check.channel,
         .time_s = check.time_s,
         .key = IsKey(check),
         .verifies = !check.follows,
         .blind = check.blind,
         .floored = check.floored,
         .stated_limit = check.stated_limit,
         .limit_by = check.limit_by});
  }
  for (const WitnessRecord& witness : report.witnesses) {
    view.witnesses.emplace_back(witness.name, witness.summary);
  }
  view.empty_counts = {{"checks_of_a_motion_with_itself", comparison.followed()},
                       {"checks_blind", comparison.blind()}};
  if (const PairComparison* pair = MainPair(comparison)) {
    view.main_pair = pair->measured + " vs " + pair->truth;
    view.main_check = pair->name() + ".force_nrmse";
  }
  return view;
}

const Trace* TraceOf(const Report& report, const std::string& witness) {
  for (const WitnessRecord& record : report.witnesses) {
    if (record.name == witness && !record.trace.time_s.empty()) return &record.trace;
  }
  return nullptr;
}

}  // namespace mbv
