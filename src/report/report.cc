#include "report/report.h"

#include <fmt/format.h>

#include <set>

namespace mbv {

const PairComparison* MainPair(const Comparison& comparison) {
  for (const char* name :
       {"simulated_vs_analytic", "simulated_vs_reference", "reference_vs_analytic"}) {
    const PairComparison* pair = comparison.FindPair(name);
    if (pair != nullptr && pair->compared) return pair;
  }
  return nullptr;
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

std::string CountLine(const std::vector<const Report*>& reports, int bad_input) {
  size_t ran = 0, compared = 0, verified = 0;
  for (const Report* report : reports) {
    bool any = false;
    for (const WitnessRecord& witness : report->witnesses) any = any || witness.summary.ok();
    ran += any ? 1 : 0;
    compared += MainPair(report->comparison) != nullptr ? 1 : 0;
    verified += report->comparison.verdict == Verdict::kAgree ? 1 : 0;
  }
  const size_t all = reports.size() + static_cast<size_t>(bad_input);
  std::string text = fmt::format("{} scenario{}: {} ran, {} compared, {} verified", all,
                                 all == 1 ? "" : "s", ran, compared, verified);
  if (bad_input > 0) text += fmt::format(", {} with bad input", bad_input);
  return text + "\n";
}

}  // namespace mbv
