// What the history can be asked.
#include <fmt/format.h>

#include <cmath>
#include <set>

#include "core/json_text.h"
#include "core/text.h"
#include "regress/history.h"
#include "regress/history_schema.h"
#include "regress/missing.h"
#include "regress/utc_time.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

struct HistoryRow {
  long result = 0;
  std::string status;
  double key_value = kNan;
  double wall_s = kNan;
};

// The value of the result's KeyMetric().
std::string KeyMetricQuery() {
  std::string names, ranks;
  for (size_t i = 0; i < KeyMetricNames().size(); ++i) {
    names += fmt::format("{}'{}'", i == 0 ? "" : ", ", KeyMetricNames()[i]);
    ranks += fmt::format(" WHEN '{}' THEN {}", KeyMetricNames()[i], i);
  }
  return fmt::format(
      "(SELECT m.value FROM metric m WHERE m.result = r.id AND m.name IN ({}) "
      "ORDER BY CASE m.name{} END LIMIT 1)",
      names, ranks);
}

std::map<std::string, HistoryRow> RowsOf(Database* database, long run) {
  Statement select(database, fmt::format("SELECT s.key, r.id, r.status, {}, r.wall_s FROM result r "
                                         "JOIN scenario s ON s.id = r.scenario WHERE r.run = ?",
                                         KeyMetricQuery()));
  select.Bind(run);
  std::map<std::string, HistoryRow> rows;
  while (select.Step()) {
    rows[select.Text(0)] = {select.Integer(1), select.Text(2), select.Real(3), select.Real(4)};
  }
  return rows;
}

std::string Value(double value) { return std::isnan(value) ? "-" : fmt::format("{:.2e}", value); }

std::string RunLine(Database* database, long run) {
  Statement select(database, "SELECT started_utc, label, program FROM run WHERE id = ?");
  if (!select.Bind(run).Step()) return "";
  const std::string label = select.Text(1);
  return fmt::format("run {}: {}{}, {}\n", run, select.Text(0), label.empty() ? "" : ", " + label,
                     select.Text(2));
}

std::string CompareRow(Database* database, const std::string& key, const HistoryRow& a,
                       const HistoryRow& b) {
  const std::string moved =
      AttributeMovement(LoadGolden(database, a.result), LoadGolden(database, b.result));
  const double ratio = b.key_value / a.key_value;
  const bool same =
      a.status == b.status && moved.empty() && (a.key_value == b.key_value || std::isnan(ratio));
  std::string line = fmt::format("  {:<52}{:>10} → {:<10}{:>7.1f} s → {:.1f} s", key,
                                 Value(a.key_value), Value(b.key_value), a.wall_s, b.wall_s);
  if (same) return line + "  same\n";
  if (a.status != b.status) line += fmt::format("  {} → {}", a.status, b.status);
  if (std::isfinite(ratio) && ratio != 1.0) line += fmt::format("  ×{:.3g}", ratio);
  if (!moved.empty()) line += "  " + moved;
  return line + "\n";
}

// Null where a run does not have the scenario.
Json ComparedJson(Database* database, const std::string& key, const HistoryRow* a,
                  const HistoryRow* b) {
  const auto side = [](const HistoryRow* row) {
    if (row == nullptr) return Json();
    return Json({{"status", row->status},
                 {"force_nrmse", Number(row->key_value)},
                 {"wall_s", Number(row->wall_s)}});
  };
  Json json = {{"scenario", key}, {"a", side(a)}, {"b", side(b)}};
  if (a != nullptr && b != nullptr) {
    json["moved"] =
        AttributeMovement(LoadGolden(database, a->result), LoadGolden(database, b->result));
  }
  return json;
}

std::string CsvNumber(double value) {
  return std::isnan(value) ? "" : fmt::format("{:.17g}", value);
}

}  // namespace

HistoryText ListRuns(const std::string& path) {
  Database database(path, Database::Mode::kRead);
  if (auto trouble = CheckSchema(path, &database); !trouble.empty()) return {"", trouble};
  std::string text = fmt::format("{:>5}  {:<20}  {:>9}  {:>4}  {:>8}  {:>8}  {:>7}  {:>8}  {}\n",
                                 "run", "started (UTC)", "as exp.", "ran", "compared", "verified",
                                 "drifted", "wall [s]", "label, program");
  Statement select(&database,
                   "SELECT id, started_utc, as_expected, total, ran, compared, verified, drifted, "
                   "wall_s, label, program, shard FROM run ORDER BY id");
  Json runs = Json::array();
  while (select.Step()) {
    const std::string label = select.Text(9), shard = select.Text(11);
    runs.push_back({{"run", select.Integer(0)},
                    {"started_utc", select.Text(1)},
                    {"as_expected", select.Integer(2)},
                    {"total", select.Integer(3)},
                    {"ran", select.Integer(4)},
                    {"compared", select.Integer(5)},
                    {"verified", select.Integer(6)},
                    {"drifted", select.Integer(7)},
                    {"wall_s", Number(select.Real(8))},
                    {"label", label},
                    {"program", select.Text(10)},
                    {"shard", shard}});
    text += fmt::format("{:>5}  {:<20}  {:>9}  {:>4}  {:>8}  {:>8}  {:>7}  {:>8.1f}  {}{}{}\n",
                        select.Integer(0), select.Text(1),
                        fmt::format("{}/{}", select.Integer(2), select.Integer(3)),
                        select.Integer(4), select.Integer(5), select.Integer(6), select.Integer(7),
                        select.Real(8), label.empty() ? "" : label + ", ", select.Text(10),
                        shard.empty() ? "" : ", shard " + shard);
  }
  return {text, database.trouble(), Dump({{"runs", std::move(runs)}})};
}

HistoryText CompareRuns(const std::string& path, const std::string& run_a,
                        const std::string& run_b) {
  Database database(path, Database::Mode::kRead);
  if (auto trouble = CheckSchema(path, &database); !trouble.empty()) return {"", trouble};
  const long a = FindRun(&database, run_a), b = FindRun(&database, run_b);
  for (const auto& [id, name] : {std::pair{a, run_a}, std::pair{b, run_b}}) {
    if (id == 0) return {"", fmt::format("history {}: there is no run '{}'", path, name)};
  }
  std::string text = RunLine(&database, a) + RunLine(&database, b);
  const auto rows_a = RowsOf(&database, a), rows_b = RowsOf(&database, b);
  text += fmt::format("  {:<52}{:>23}{:>18}\n", "scenario", "force error (RMS)", "wall time");
  Json scenarios = Json::array();
  for (const auto& [key, row] : rows_b) {
    const auto before = rows_a.find(key);
    scenarios.push_back(
        ComparedJson(&database, key, before == rows_a.end() ? nullptr : &before->second, &row));
    text += before == rows_a.end() ? fmt::format("  {:<52}  only in run {}\n", key, b)
                                   : CompareRow(&database, key, before->second, row);
  }
  for (const auto& [key, row] : rows_a) {
    if (rows_b.contains(key)) continue;
    text += fmt::format("  {:<52}  only in run {}\n", key, a);
    scenarios.push_back(ComparedJson(&database, key, &row, nullptr));
  }
  return {text, database.trouble(),
          Dump({{"run_a", a}, {"run_b", b}, {"scenarios", std::move(scenarios)}})};
}

HistoryText HistoryCsv(const std::string& path) {
  Database database(path, Database::Mode::kRead);
  if (auto trouble = CheckSchema(path, &database); !trouble.empty()) return {"", trouble};
  std::string text =
      "run,started_utc,label,program,scenario,status,verdict,exit_code,wall_s,cpu_s,peak_kib,"
      "metric,value,limit,pass,drifted\n";
  Statement select(&database,
                   "SELECT u.id, u.started_utc, u.label, u.program, s.key, r.status, r.verdict, "
                   "r.exit_code, r.wall_s, r.cpu_s, r.peak_kib, m.name, m.value, m.upper_limit, "
                   "m.pass, m.drifted FROM run u JOIN result r ON r.run = u.id JOIN scenario s ON "
                   "s.id = r.scenario LEFT JOIN metric m ON m.result = r.id "
                   "ORDER BY u.id, s.key, m.name");
  while (select.Step()) {
    const bool metric = !select.Text(11).empty();
    text +=
        fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", select.Integer(0),
                    CsvCell(select.Text(1)), CsvCell(select.Text(2)), CsvCell(select.Text(3)),
                    CsvCell(select.Text(4)), CsvCell(select.Text(5)), CsvCell(select.Text(6)),
                    select.Integer(7), CsvNumber(select.Real(8)), CsvNumber(select.Real(9)),
                    select.Integer(10), CsvCell(select.Text(11)), CsvNumber(select.Real(12)),
                    CsvNumber(select.Real(13)), metric ? fmt::format("{}", select.Integer(14)) : "",
                    metric ? fmt::format("{}", select.Integer(15)) : "");
  }
  return {text, database.trouble()};
}

HistoryText AcceptRun(const std::string& path, const std::string& run, const std::string& key,
                      const std::string& note) {
  Database database(path, Database::Mode::kWrite);
  if (auto trouble = CheckSchema(path, &database); !trouble.empty()) return {"", trouble};
  database.Run("BEGIN IMMEDIATE");
  if (auto trouble = PrepareSchema(path, &database); !trouble.empty()) return {"", trouble};
  const long id = FindRun(&database, run);
  if (id == 0) return {"", fmt::format("history {}: there is no run '{}'", path, run)};
  Statement insert(
      &database,
      "INSERT OR REPLACE INTO accepted SELECT r.scenario, r.run, ?, ? FROM result r "
      "JOIN scenario s ON s.id = r.scenario WHERE r.run = ? AND (? = '' OR s.key = ?)");
  insert.Bind(UtcNow(), note, id, key, key).Execute();
  Statement count(&database, "SELECT changes()");
  const long accepted = count.Step() ? count.Integer(0) : 0;
  long gone = 0;
  Statement insert_gone(&database,
                        "INSERT OR REPLACE INTO accepted SELECT id, ?, ?, ? FROM scenario WHERE "
                        "key = ?");
  for (const MissingCase& missing : FindMissing(&database, id)) {
    if (!key.empty() && missing.key != key) continue;
    insert_gone.Bind(id, UtcNow(), note, missing.key).Execute();
    ++gone;
  }
  if (accepted + gone == 0) {
    return {"", fmt::format("history {}: run {} has no scenario '{}'", path, id, key)};
  }
  database.Run("COMMIT");
  std::string text = fmt::format("baselines of {} scenario{} start with run {}\n", accepted,
                                 accepted == 1 ? "" : "s", id);
  if (gone > 0)
    text += fmt::format("{} missing in it {} meant to be\n", gone, gone == 1 ? "is" : "are");
  return {text, database.trouble()};
}

std::map<std::string, double> LastWallTimes(const std::string& path) {
  Database database(path, Database::Mode::kRead);
  if (!CheckSchema(path, &database).empty()) return {};
  std::map<std::string, double> times;
  Statement select(&database,
                   "SELECT s.key, r.wall_s FROM result r JOIN scenario s ON s.id = r.scenario "
                   "WHERE r.run > (SELECT MAX(id) FROM run) - 5 ORDER BY r.run");
  while (select.Step()) times[select.Text(0)] = select.Real(1);
  return times;
}

}  // namespace mbv
