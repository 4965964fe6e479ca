#include "features/regress/trouble_text.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <tuple>

#include "features/regress/find_cases.h"
#include "scenario/checks.h"

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

// "changed since: turn.yaml changed"; "" where nothing did.
std::string SinceText(const CaseResult& result) {
  return result.changes.empty() ? ""
                                : fmt::format("changed since: {}", fmt::join(result.changes, "; "));
}

}  // namespace

std::string QuantityText(const std::string& check) {
  const size_t dot = check.rfind('.');
  if (dot == std::string::npos) return check;
  const std::string key = check.substr(dot + 1);
  const MetricRow* row = FindMetric(key);
  if (row == nullptr) row = FindMetric(key, StiffnessMetricRows());
  if (row == nullptr) return check;
  std::string of = check.substr(0, dot);
  std::replace(of.begin(), of.end(), '_', ' ');
  const std::string unit = *row->unit == '\0' ? "" : fmt::format(" [{}]", row->unit);
  return fmt::format("{}{} ({})", row->title, unit, of);
}

std::string CheckText(const CaseResult& result,
                      const std::pair<const std::string, MetricValue>& check) {
  const auto& [name, metric] = check;
  std::string text =
      fmt::format("{} is {:.2e}, limit {:.1e}", QuantityText(name), metric.value, *metric.limit);
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
  if (!result.changes.empty()) texts.push_back(SinceText(result));
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
                             QuantityText(drifts[i]->metric), DriftRatio(*drifts[i]));
    }
  }
  if (left_out > 0) further += fmt::format(" and {} more", left_out);
  line += further + moved;
  if (!drifts.front()->since.empty()) line += "; since " + drifts.front()->since;
  if (!result.changes.empty()) line += "; " + SinceText(result);
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
  cases.reserve(ranked.size());
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

namespace {

// Which files were read is kept from this version on.
constexpr long kVersionWithInputs = 4;

constexpr double kNoise = 1e-13;        // as of DriftRule
constexpr double kOtherByShare = 0.01;  // a value differs
constexpr size_t kChangesNamed = 6;     // of one kind

std::map<std::string, std::string> PairsOf(Database* database, const std::string& sql, long id) {
  std::map<std::string, std::string> pairs;
  Statement select(database, sql);
  select.Bind(id);
  while (select.Step()) pairs[select.Text(0)] = select.Text(1);
  return pairs;
}

// The first of them, then how many more.
void AddSome(const Changes& some, Changes* changes) {
  for (size_t i = 0; i < std::min(some.size(), kChangesNamed); ++i) changes->push_back(some[i]);
  if (some.size() > kChangesNamed) {
    changes->push_back(fmt::format("and {} more", some.size() - kChangesNamed));
  }
}

Changes LimitChanges(Database* database, long before, long now) {
  Statement select(database,
                   "SELECT b.name, a.upper_limit, b.upper_limit FROM metric a JOIN metric b ON "
                   "b.name = a.name WHERE a.result = ? AND b.result = ? AND "
                   "a.upper_limit IS NOT b.upper_limit ORDER BY b.name");
  select.Bind(before, now);
  Changes changes;
  const auto text = [](double limit) {
    return std::isnan(limit) ? std::string("none") : fmt::format("{:.3g}", limit);
  };
  while (select.Step()) {
    changes.push_back(fmt::format("limit of {} was {}, is {}", QuantityText(select.Text(0)),
                                  text(select.Real(1)), text(select.Real(2))));
  }
  return changes;
}

// By the place of a file, which may be another one on another machine: then by its name.
Changes InputChanges(Database* database, long before, long now) {
  const std::string kInputs = "SELECT 'inputs', inputs FROM result WHERE id = ?";
  const std::string was = PairsOf(database, kInputs, before)["inputs"];
  const std::string is = PairsOf(database, kInputs, now)["inputs"];
  if (was == is) return {};
  Statement version(database, "PRAGMA user_version");
  std::map<std::string, std::string> a, b;
  if (version.Step() && version.Integer(0) >= kVersionWithInputs) {
    const std::string kFiles =
        "SELECT f.file, f.fingerprint FROM input_file f JOIN result r ON r.inputs = f.inputs "
        "WHERE r.id = ?";
    a = PairsOf(database, kFiles, before);
    b = PairsOf(database, kFiles, now);
  }
  if (a.empty() || b.empty()) return {"an input file changed (which one is not in the history)"};
  const auto name = [](const std::string& file) { return fs::path(file).filename().string(); };
  Changes changes, gone, added;
  for (const auto& [file, print] : b) {
    const auto found = a.find(file);
    if (found == a.end()) added.push_back(name(file) + " is new");
    if (found != a.end() && found->second != print) changes.push_back(name(file) + " changed");
  }
  for (const auto& [file, print] : a) {
    if (!b.contains(file)) gone.push_back(name(file) + " is not read any more");
  }
  changes.insert(changes.end(), added.begin(), added.end());
  changes.insert(changes.end(), gone.begin(), gone.end());
  if (changes.empty()) changes.emplace_back("the order of input files changed");
  return changes;
}

}  // namespace

bool IsOther(double before, double now) {
  if (std::isnan(before) || std::isnan(now)) return std::isnan(before) != std::isnan(now);
  const double a = std::max(std::abs(before), kNoise), b = std::max(std::abs(now), kNoise);
  return !(std::abs(a - b) <= kOtherByShare * std::max(a, b));
}

Changes ChangesOfResult(Database* database, long before, long now) {
  Changes changes;
  AddSome(LimitChanges(database, before, now), &changes);
  AddSome(InputChanges(database, before, now), &changes);
  return changes;
}

Changes ChangesOfRun(Database* database, long before, long now) {
  Changes changes;
  for (const char* of : {"program", "host"}) {
    const std::string sql = fmt::format("SELECT '{0}', {0} FROM run WHERE id = ?", of);
    const std::string was = PairsOf(database, sql, before)[of];
    const std::string is = PairsOf(database, sql, now)[of];
    if (was != is) changes.push_back(fmt::format("{} {} → {}", of, was, is));
  }
  const std::string kVersions = "SELECT name, version FROM version WHERE run = ?";
  const auto was = PairsOf(database, kVersions, before), is = PairsOf(database, kVersions, now);
  Changes versions;
  for (const auto& [name, version] : is) {
    const auto found = was.find(name);
    // The program's own is part of the text above.
    if (name == "mbverify" || (found != was.end() && found->second == version)) continue;
    versions.push_back(
        fmt::format("{} {} → {}", name, found == was.end() ? "(none)" : found->second, version));
  }
  AddSome(versions, &changes);
  return changes;
}

std::string DescribeRun(Database* database, long run) {
  Statement find(database, "SELECT started_utc, label, program FROM run WHERE id = ?");
  if (!find.Bind(run).Step()) return "";
  const std::string label = find.Text(1);
  return fmt::format("run {} of {}{}, {}", run, find.Text(0), label.empty() ? "" : ", " + label,
                     find.Text(2));
}

}  // namespace mbv
