// Pairs and single witnesses → checks, verdict.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/comparison.h"

namespace mbv {
namespace {

const Witness* FindWitness(const ComparisonInput& input, const std::string& name) {
  for (const Witness& witness : input.witnesses) {
    if (witness.name == name) return &witness;
  }
  return nullptr;
}

// "reference: singular pose near limb2.R12 (t = 3.22 s)".
std::string Explain(const Witness& witness) {
  std::string text = witness.name + ": " + witness.summary.message;
  const bool has_time = witness.summary.message.find("t = ") != std::string::npos;
  if (!has_time && !std::isnan(witness.summary.time_s)) {
    text += fmt::format(" (t = {:.6g} s)", witness.summary.time_s);
  }
  return text;
}

bool Ran(const Witness& witness) { return witness.trace != nullptr && witness.summary.ok(); }

// Why a pair cannot be compared, from its two witnesses; "" if both ran.
std::string WhyNot(const Witness& a, const Witness& b) {
  std::string why;
  for (const Witness* witness : {&a, &b}) {
    if (Ran(*witness)) continue;
    why += (why.empty() ? "" : "; ") + Explain(*witness);
  }
  return why;
}

LimitColumn ColumnOf(const ComparisonInput& input, const std::string& measured) {
  return measured == "simulated" ? input.simulation_limits : LimitColumn::kReference;
}

void AddChecks(const ComparisonInput& input, const std::string& subject, LimitColumn column,
               const std::map<Metric, Measured>& metrics, Comparison* comparison) {
  for (const auto& [metric, measured] : metrics) {
    CheckResult check{.name = subject + "." + RowOf(metric).key,
                      .subject = subject,
                      .metric = metric,
                      .value = measured.value,
                      .limit = input.limits[metric].Of(column),
                      .time_s = measured.time_s,
                      .channel = measured.channel};
    check.pass = check.limit && check.value <= *check.limit;  // false for NaN
    comparison->checks.push_back(std::move(check));
  }
}

void AddPair(const ComparisonInput& input, const char* measured, const char* truth,
             Comparison* comparison) {
  const Witness* a = FindWitness(input, measured);
  const Witness* b = FindWitness(input, truth);
  if (a == nullptr || b == nullptr) return;
  PairComparison pair;
  pair.measured = measured;
  pair.truth = truth;
  pair.reason = WhyNot(*a, *b);
  if (pair.reason.empty()) pair = ComparePair(input, *a->trace, *b->trace);
  if (!pair.compared) comparison->not_compared.push_back({pair.name(), pair.reason});
  AddChecks(input, pair.name(), ColumnOf(input, measured), pair.metrics, comparison);
  comparison->pairs.push_back(std::move(pair));
}

// Quantities that one would expect to be judged but that the traces do not hold.
void AddMissingNotes(const ComparisonInput& input, Comparison* comparison) {
  const auto note = [&](const std::string& what, const char* why) {
    comparison->not_compared.push_back({what, why});
  };
  for (const PairComparison& pair : comparison->pairs) {
    if (!pair.compared) continue;
    if (!input.mechanism->outputs.empty() && !pair.metrics.contains(Metric::kPoseM)) {
      note(pair.name() + ".pose", "the outputs are not recorded by both");
    }
    if (pair.reactions.empty()) {
      note(pair.name() + ".reaction", "no unique joint reaction is recorded by both");
    }
  }
  for (const WitnessMetrics& witness : comparison->witnesses) {
    if (witness.witness == "analytic") continue;  // has no bodies to close and no energy
    if (!witness.metrics.contains(Metric::kClosureM))
      note(witness.witness + ".closure", "not recorded");
    if (!witness.metrics.contains(Metric::kPower)) note(witness.witness + ".power", "not recorded");
  }
}

void AddReactionNotes(const ComparisonInput& input, Comparison* comparison) {
  for (const std::string& joint : input.joints_not_unique) {
    comparison->not_compared.push_back(
        {joint + ".reaction", "statics alone does not determine it (redundant constraints)"});
  }
}

// Prescribed motion is imposed; no witness records it as a signal.
void AddCommandNotes(const ComparisonInput& input, Comparison* comparison) {
  for (const Command& command : input.motion->commands) {
    for (const Command::Term& term : command.terms) {
      if (term.coordinate.kind != Coordinate::Kind::kPrescribed) continue;
      comparison->not_compared.push_back(
          {command.name, "a prescribed joint's motion is an input and is not measured back"});
    }
  }
}

// A witness that started and broke down, or nullptr.
const Witness* FindBroken(const ComparisonInput& input) {
  for (const Witness& witness : input.witnesses) {
    if (!witness.summary.ok() && witness.summary.stop != Stop::kNotRun) return &witness;
  }
  return nullptr;
}

void Judge(const ComparisonInput& input, Comparison* comparison) {
  if (const Witness* broken = FindBroken(input)) {
    comparison->reason = Explain(*broken);
    return;
  }
  const auto compared = std::count_if(comparison->pairs.begin(), comparison->pairs.end(),
                                      [](const PairComparison& p) { return p.compared; });
  if (compared == 0) {
    comparison->verdict = Verdict::kNotRun;
    comparison->reason = "no drive force could be compared";
    if (!comparison->pairs.empty()) comparison->reason += ": " + comparison->pairs.front().reason;
    return;
  }
  const bool force_judged = std::any_of(
      comparison->checks.begin(), comparison->checks.end(),
      [](const CheckResult& check) { return check.limit && IsDriveForce(check.metric); });
  if (!force_judged) {
    comparison->reason = "every force check is switched off, so nothing was verified";
    return;
  }
  const size_t failed = comparison->failed();
  comparison->verdict = failed == 0 ? Verdict::kAgree : Verdict::kDisagree;
  comparison->reason =
      failed == 0 ? fmt::format("all {} checks are within their limits", comparison->verified())
                  : fmt::format("{} of {} checks exceed their limits", failed,
                                failed + comparison->verified());
}

}  // namespace

const char* ToText(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNotRun:
      return "not_run";
    case Verdict::kAgree:
      return "agree";
    case Verdict::kDisagree:
      return "disagree";
  }
  return "?";
}

const PairComparison* Comparison::FindPair(const std::string& name) const {
  for (const PairComparison& pair : pairs) {
    if (pair.name() == name) return &pair;
  }
  return nullptr;
}

const CheckResult* Comparison::FindCheck(const std::string& name) const {
  for (const CheckResult& check : checks) {
    if (check.name == name) return &check;
  }
  return nullptr;
}

size_t Comparison::failed() const {
  return static_cast<size_t>(std::count_if(
      checks.begin(), checks.end(), [](const CheckResult& c) { return c.limit && !c.pass; }));
}

size_t Comparison::verified() const {
  return static_cast<size_t>(std::count_if(checks.begin(), checks.end(),
                                           [](const CheckResult& c) { return c.limit && c.pass; }));
}

Comparison Compare(const ComparisonInput& input) {
  Comparison comparison;
  AddPair(input, "simulated", "analytic", &comparison);
  AddPair(input, "reference", "analytic", &comparison);
  AddPair(input, "simulated", "reference", &comparison);
  for (const Witness& witness : input.witnesses) {
    if (!Ran(witness)) continue;
    WitnessMetrics metrics = MeasureWitness(input, *witness.trace);
    AddChecks(input, witness.name, ColumnOf(input, witness.name), metrics.metrics, &comparison);
    comparison.witnesses.push_back(std::move(metrics));
  }
  AddMissingNotes(input, &comparison);
  AddReactionNotes(input, &comparison);
  AddCommandNotes(input, &comparison);
  Judge(input, &comparison);
  comparison.attribution = Attribute(input, comparison);
  return comparison;
}

}  // namespace mbv
