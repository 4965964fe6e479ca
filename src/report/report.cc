#include "report/report.h"

#include <fmt/format.h>

#include <set>

namespace mbv {

const PairComparison* MainPair(const Comparison& comparison) {
  for (const char* name : {"simulated_vs_reached", "simulated_vs_analytic",
                           "simulated_vs_reference", "reference_vs_analytic"}) {
    const PairComparison* pair = comparison.FindPair(name);
    if (pair != nullptr && pair->compared) return pair;
  }
  return nullptr;
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

RunCounts& RunCounts::operator+=(const RunCounts& other) {
  scenarios += other.scenarios;
  ran += other.ran;
  compared += other.compared;
  verified += other.verified;
  bad_input += other.bad_input;
  return *this;
}

RunCounts CountOf(const Report& report) {
  RunCounts counts{.scenarios = 1};
  for (const WitnessRecord& witness : report.witnesses) {
    if (witness.summary.ok()) counts.ran = 1;
  }
  counts.compared = MainPair(report.comparison) != nullptr ? 1 : 0;
  counts.verified = report.comparison.verdict == Verdict::kAgree ? 1 : 0;
  return counts;
}

std::string CountLine(const RunCounts& counts) {
  std::string text =
      fmt::format("{} scenario{}: {} ran, {} compared, {} verified", counts.scenarios,
                  counts.scenarios == 1 ? "" : "s", counts.ran, counts.compared, counts.verified);
  if (counts.bad_input > 0) text += fmt::format(", {} with bad input", counts.bad_input);
  return text + "\n";
}

const Trace* TraceOf(const Report& report, const std::string& witness) {
  for (const WitnessRecord& record : report.witnesses) {
    if (record.name == witness && !record.trace.time_s.empty()) return &record.trace;
  }
  return nullptr;
}

}  // namespace mbv
