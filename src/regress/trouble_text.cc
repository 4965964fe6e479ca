#include "regress/trouble_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace mbv {
namespace {

constexpr size_t kFurtherDrifts = 3;  // named after the worst one

double DriftRatio(const Drift& drift) {
  const double ratio = drift.value / drift.baseline;
  return std::isnan(ratio) ? 0.0 : ratio;  // traces that moved have none
}

std::vector<const Drift*> WorstDriftsFirst(const CaseResult& result) {
  std::vector<const Drift*> drifts;
  for (const Drift& drift : result.drifts) drifts.push_back(&drift);
  std::stable_sort(drifts.begin(), drifts.end(),
                   [](const Drift* a, const Drift* b) { return DriftRatio(*a) > DriftRatio(*b); });
  return drifts;
}

// Smaller is worse.
int RankOf(const CaseResult& result) {
  switch (result.status) {
    case CaseStatus::kCrashed:
    case CaseStatus::kInternalError:
      return 0;
    case CaseStatus::kTimedOut:
    case CaseStatus::kNotRun:
      return 1;
    case CaseStatus::kCouldNotRun:
    case CaseStatus::kBadInput:
      return 2;
    case CaseStatus::kUnexpected:
      return 3;
    case CaseStatus::kAsExpected:
      break;
  }
  return !result.drifts.empty() ? 4 : result.verified ? 5 : 6;
}

// By which of two cases of one rank the larger is worse.
double ExcessOf(const CaseResult& result) {
  if (result.failed()) {
    const auto checks = FailedChecks(result);
    if (checks.empty()) return 0.0;
    const double ratio = checks.front()->second.value / *checks.front()->second.limit;
    return std::isfinite(ratio) ? ratio : HUGE_VAL;
  }
  double worst = 0.0;
  for (const Drift& drift : result.drifts) worst = std::max(worst, DriftRatio(drift));
  return worst;
}

}  // namespace

std::string CheckText(const CaseResult& result,
                      const std::pair<const std::string, MetricValue>& check) {
  const auto& [name, metric] = check;
  std::string text = fmt::format("{} is {:.2e}, limit {:.1e}", name, metric.value, *metric.limit);
  if (!metric.channel.empty()) text += ", at " + metric.channel;
  if (std::isfinite(metric.time_s)) {
    text += fmt::format("{}{:.5g} s", metric.channel.empty() ? ", at " : ", ", metric.time_s);
  }
  const auto before = result.past.values.find(name);
  if (before != result.past.values.end() && std::isfinite(before->second)) {
    text += fmt::format("; was {:.2e} in run {}", before->second, result.past.good_run);
  }
  return text;
}

std::vector<std::string> FailureTexts(const CaseResult& result, size_t most) {
  std::vector<std::string> texts;
  if (!result.failed()) return texts;
  const auto checks = FailedChecks(result);
  for (size_t i = 0; i < std::min(most, checks.size()); ++i) {
    texts.push_back(CheckText(result, *checks[i]));
  }
  if (checks.size() > most) {
    texts.push_back(fmt::format("and {} more failed checks", checks.size() - most));
  }
  const PastOfFailure& past = result.past;
  if (past.good_run != 0) {
    texts.push_back("was ok in " + past.when);
  } else if (past.runs > 0) {
    texts.push_back(
        fmt::format("was never ok in {} earlier run{}", past.runs, past.runs == 1 ? "" : "s"));
  }
  return texts;
}

std::string FailureLine(const CaseResult& result) {
  std::string line = result.reason;
  const auto checks = FailedChecks(result);
  if (!checks.empty()) line += "; " + CheckText(result, *checks.front());
  return line;
}

std::string DriftLine(const CaseResult& result) {
  const std::vector<const Drift*> drifts = WorstDriftsFirst(result);
  if (drifts.empty()) return "";
  std::string line = drifts.front()->text, further, moved;
  size_t named = 0, left_out = 0;
  for (size_t i = 1; i < drifts.size(); ++i) {
    if (DriftRatio(*drifts[i]) == 0.0) {
      moved += "; " + drifts[i]->text;
    } else if (named == kFurtherDrifts) {
      ++left_out;
    } else {
      further += fmt::format("{}{} {:.0f} times", named++ == 0 ? "; also " : ", ",
                             drifts[i]->metric, DriftRatio(*drifts[i]));
    }
  }
  if (left_out > 0) further += fmt::format(" and {} more", left_out);
  line += further + moved;
  if (!drifts.front()->since.empty()) line += "; since " + drifts.front()->since;
  return line;
}

std::string MissingText(const MissingCase& missing) {
  return fmt::format("was in {}, and was not found now", missing.when);
}

std::vector<const CaseResult*> BySeverity(const RegressReport& report) {
  std::vector<std::tuple<int, double, const CaseResult*>> ranked;
  for (const CaseResult& result : report.cases) {
    ranked.emplace_back(RankOf(result), -ExcessOf(result), &result);
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
    return std::tie(std::get<0>(a), std::get<1>(a)) < std::tie(std::get<0>(b), std::get<1>(b));
  });
  std::vector<const CaseResult*> cases;
  for (const auto& entry : ranked) cases.push_back(std::get<2>(entry));
  return cases;
}

}  // namespace mbv
