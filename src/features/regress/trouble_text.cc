#include "features/regress/trouble_text.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <tuple>

#include "features/regress/find_cases.h"

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

namespace {

constexpr unsigned char kEscape = 0x1b;

}  // namespace

std::string WithoutControls(const std::string& text) {
  std::string clean;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == kEscape && i + 1 < text.size() && text[i + 1] == '[') {  // a terminal's colour
      i += 2;
      while (i < text.size() && (text[i] < '@' || text[i] > '~')) ++i;
      continue;
    }
    if (c >= 0x20 || c == '\n' || c == '\t') clean += text[i];
  }
  return clean;
}

std::string LastLines(const std::string& text, int count) {
  const std::string clean = WithoutControls(text);
  const size_t end = clean.find_last_not_of("\n ");
  if (end == std::string::npos) return "";
  size_t at = end;
  for (int i = 0; i < count; ++i) {
    const size_t newline = clean.rfind('\n', at);
    if (newline == std::string::npos || newline == 0) return clean.substr(0, end + 1);
    at = newline - 1;
  }
  return clean.substr(at + 2, end - at - 1);
}

namespace {

namespace fs = std::filesystem;

// Each beginning on a line of its own after a colon, as the beginning of all names is empty.
std::vector<std::string> FromCoversText(const std::string& text) {
  std::vector<std::string> covers;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size());
    covers.push_back(text.substr(at + 1, end - at - 1));
    at = end + 1;
  }
  return covers;
}

}  // namespace

std::vector<std::string> CoversOf(const std::vector<std::string>& paths) {
  std::vector<std::string> covers;
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error)) continue;
    std::string key = CaseKey((fs::path(path) / "x.yaml").string());
    key.pop_back();
    covers.push_back(std::move(key));
  }
  std::sort(covers.begin(), covers.end());
  return covers;
}

std::string CoversText(const RunInfo& run) {
  std::string text;
  if (!run.shard.empty() || run.partial) return text;
  for (const std::string& beginning : run.covers) text += ":" + beginning + "\n";
  return text;
}

std::vector<MissingCase> FindMissing(Database* database, long run) {
  Statement own(database, "SELECT covers FROM run WHERE id = ?");
  if (!own.Bind(run).Step()) return {};
  const std::vector<std::string> covers = FromCoversText(own.Text(0));
  // Of runs of unknown extent only the newest one says what is usual.
  Statement select(
      database,
      "SELECT key, last FROM (SELECT s.id AS id, s.key AS key, MAX(r.run) AS last FROM result r "
      "JOIN scenario s ON s.id = r.scenario JOIN run u ON u.id = r.run WHERE r.run < ?1 AND "
      "(u.covers IS NOT NULL OR u.id = (SELECT MAX(id) FROM run WHERE id < ?1)) AND NOT EXISTS("
      "SELECT 1 FROM result n WHERE n.run = ?1 AND n.scenario = s.id) GROUP BY s.id) WHERE NOT "
      "EXISTS(SELECT 1 FROM accepted a WHERE a.scenario = id AND a.run > last) ORDER BY key");
  select.Bind(run);
  std::vector<MissingCase> missing;
  while (select.Step()) {
    const std::string key = select.Text(0);
    const bool covered = std::any_of(covers.begin(), covers.end(), [&](const auto& beginning) {
      return key.starts_with(beginning);
    });
    if (covered) missing.push_back({key, select.Integer(1), ""});
  }
  for (MissingCase& item : missing) item.when = DescribeRun(database, item.last_run);
  return missing;
}

std::string DescribeRun(Database* database, long run) {
  Statement find(database, "SELECT started_utc, label, program FROM run WHERE id = ?");
  if (!find.Bind(run).Step()) return "";
  const std::string label = find.Text(1);
  return fmt::format("run {} of {}{}, {}", run, find.Text(0), label.empty() ? "" : ", " + label,
                     find.Text(2));
}

}  // namespace mbv
