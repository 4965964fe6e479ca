#include "report/report.h"

#include <fmt/format.h>

#include <set>

namespace mbv {

std::string AtRestText(const Comparison& comparison) {
  const PairComparison* pair = comparison.MainPair();
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
  ResultView view = ViewOfComparison(report, report.comparison, Metric::kForceNrmse);
  for (const WitnessRecord& witness : report.witnesses) {
    view.witnesses.emplace_back(witness.name, witness.summary);
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
