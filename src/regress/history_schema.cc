#include "regress/history_schema.h"

#include <fmt/format.h>

#include <charconv>

namespace mbv {
namespace {

constexpr const char* kTables = R"sql(
CREATE TABLE IF NOT EXISTS run(
  id INTEGER PRIMARY KEY AUTOINCREMENT, uid TEXT,
  started_utc TEXT NOT NULL, finished_utc TEXT NOT NULL, wall_s REAL, jobs INTEGER,
  label TEXT NOT NULL, host TEXT NOT NULL, program TEXT NOT NULL, shard TEXT NOT NULL,
  exit_code INTEGER NOT NULL, total INTEGER NOT NULL, as_expected INTEGER NOT NULL,
  ran INTEGER NOT NULL, compared INTEGER NOT NULL, verified INTEGER NOT NULL,
  drifted INTEGER NOT NULL, covers TEXT);
CREATE TABLE IF NOT EXISTS scenario(
  id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE);
CREATE TABLE IF NOT EXISTS result(
  id INTEGER PRIMARY KEY,
  run INTEGER NOT NULL REFERENCES run(id), scenario INTEGER NOT NULL REFERENCES scenario(id),
  status TEXT NOT NULL, verdict TEXT NOT NULL, exit_code INTEGER NOT NULL, reason TEXT NOT NULL,
  inputs TEXT NOT NULL, wall_s REAL, cpu_s REAL, peak_kib INTEGER,
  UNIQUE(run, scenario));
CREATE INDEX IF NOT EXISTS result_of_scenario ON result(scenario, run);
CREATE TABLE IF NOT EXISTS metric(
  result INTEGER NOT NULL REFERENCES result(id), name TEXT NOT NULL,
  value REAL, upper_limit REAL, pass INTEGER NOT NULL, drifted INTEGER NOT NULL,
  PRIMARY KEY(result, name)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS version(
  run INTEGER NOT NULL REFERENCES run(id), name TEXT NOT NULL, version TEXT NOT NULL,
  PRIMARY KEY(run, name)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS drift(
  result INTEGER NOT NULL REFERENCES result(id), metric TEXT NOT NULL,
  value REAL, baseline REAL, since_run INTEGER NOT NULL, text TEXT NOT NULL,
  PRIMARY KEY(result, metric)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS trace(
  id INTEGER PRIMARY KEY, digest TEXT NOT NULL, bytes BLOB NOT NULL);
CREATE INDEX IF NOT EXISTS trace_digest ON trace(digest);
CREATE TABLE IF NOT EXISTS golden(
  result INTEGER NOT NULL REFERENCES result(id), witness TEXT NOT NULL,
  trace INTEGER NOT NULL REFERENCES trace(id),
  PRIMARY KEY(result, witness)) WITHOUT ROWID;
CREATE INDEX IF NOT EXISTS golden_trace ON golden(trace);
CREATE TABLE IF NOT EXISTS accepted(
  scenario INTEGER NOT NULL REFERENCES scenario(id), run INTEGER NOT NULL REFERENCES run(id),
  accepted_utc TEXT NOT NULL, note TEXT NOT NULL,
  PRIMARY KEY(scenario, run)) WITHOUT ROWID;
)sql";

long Version(Database* database) {
  Statement statement(database, "PRAGMA user_version");
  return statement.Step() ? statement.Integer(0) : 0;
}

bool HasTables(Database* database) {
  Statement statement(database, "SELECT COUNT(*) FROM sqlite_master");
  return statement.Step() && statement.Integer(0) > 0;
}

}  // namespace

std::string CheckSchema(const std::string& path, Database* database) {
  const long version = Version(database);
  if (!database->ok()) return database->trouble();
  if (version >= 1 && version <= kHistoryVersion) return "";
  return version == 0 ? fmt::format("history {}: holds no runs", path)
                      : fmt::format("history {}: has schema {}, this program knows {}", path,
                                    version, kHistoryVersion);
}

std::string CheckWritable(const std::string& path, Database* database) {
  const long version = Version(database);
  if (database->ok() && version != 0) return CheckSchema(path, database);
  if (database->ok() && HasTables(database)) {
    return fmt::format("history {}: is another program's database", path);
  }
  return database->trouble();
}

std::string PrepareSchema(const std::string& path, Database* database) {
  const long version = Version(database);
  if (std::string trouble = CheckWritable(path, database); !trouble.empty()) return trouble;
  database->Run(kTables);
  if (version == 1) database->Run("ALTER TABLE run ADD COLUMN uid TEXT");
  if (version == 1 || version == 2) database->Run("ALTER TABLE run ADD COLUMN covers TEXT");
  database->Run("CREATE UNIQUE INDEX IF NOT EXISTS run_uid ON run(uid)");
  database->Run(fmt::format("PRAGMA user_version = {}", kHistoryVersion));
  return database->trouble();
}

long FindRun(Database* database, const std::string& text) {
  const auto number = [](std::string_view digits) -> long {
    long value = -1;
    const auto parsed = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    return parsed.ec == std::errc() && parsed.ptr == digits.data() + digits.size() ? value : -1;
  };
  constexpr std::string_view kLast = "last";
  const std::string_view view = text;
  const bool relative = view.starts_with(kLast);
  long count = 0;
  if (relative && view.size() > kLast.size()) {
    count = view[kLast.size()] == '~' ? number(view.substr(kLast.size() + 1)) : -1;
  }
  if (!relative) count = number(view);
  if (count < 0) return 0;
  Statement find(database, relative ? "SELECT id FROM run ORDER BY id DESC LIMIT 1 OFFSET ?"
                                    : "SELECT id FROM run WHERE id = ?");
  return find.Bind(count).Step() ? find.Integer(0) : 0;
}

GoldenTraces LoadGolden(Database* database, long result) {
  GoldenTraces traces;
  Statement select(database,
                   "SELECT g.witness, t.bytes FROM golden g JOIN trace t ON t.id = g.trace "
                   "WHERE g.result = ?");
  select.Bind(result);
  while (select.Step()) {
    if (auto trace = DecodeForces(select.Text(1))) traces[select.Text(0)] = *std::move(trace);
  }
  return traces;
}

}  // namespace mbv
