#include "regress/missing.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "regress/find_cases.h"

namespace mbv {
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
