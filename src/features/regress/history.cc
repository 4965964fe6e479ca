#include "features/regress/history.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <thread>

#include "base/files.h"
#include "base/json_text.h"
#include "base/text.h"
#include "features/regress/run_folder.h"
#include "features/regress/trouble_text.h"

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
CREATE TABLE IF NOT EXISTS input_file(
  inputs TEXT NOT NULL, file TEXT NOT NULL, fingerprint TEXT NOT NULL,
  PRIMARY KEY(inputs, file)) WITHOUT ROWID;
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

// Appends a run to the history, judging it against the runs before.

namespace {

namespace fs = std::filesystem;

// Runs of a scenario that are looked at: enough for a window of good ones with failed runs
// between.
constexpr int kPastRuns = 400;
// A database that another program holds is free within 5 s.
constexpr int kLockedAttempts = 50;
constexpr std::chrono::milliseconds kLockedPause{100};

class Appender {
 public:
  Appender(Database* database, const HistoryOptions& options) : db_(database), options_(options) {}

  void Append(const std::map<std::string, GoldenTraces>& goldens, RegressReport* report) {
    InsertRun(report);
    for (CaseResult& result : report->cases) {
      const long scenario = ScenarioId(result.key);
      const long since = AcceptedRun(scenario);
      FindDrifts(scenario, since, &result);
      const auto golden = goldens.find(result.key);
      if (golden != goldens.end()) FindMovement(scenario, since, golden->second, &result);
      FillCourse(scenario, &result);
      FillPast(scenario, report->run.id, &result);
      const long id = InsertResult(report->run.id, scenario, result);
      FillChanges(scenario, report->run.id, id, &result);
      if (golden != goldens.end()) InsertGolden(id, golden->second);
    }
    report->missing = FindMissing(db_, report->run.id);
    FinishRun(*report);
    DropOldGolden();
  }

 private:
  void InsertRun(RegressReport* report) {
    const RunInfo& run = report->run;
    const long known = run.uid.empty() ? 0 : ForgetRun(run.uid);
    Statement(db_,
              "INSERT OR REPLACE INTO run(id, uid, started_utc, finished_utc, wall_s, jobs, label, "
              "host, program, shard, covers, exit_code, total, as_expected, ran, compared, "
              "verified, drifted) "
              "VALUES(NULLIF(?,0),NULLIF(?,''),?,?,?,?,?,?,?,?,NULLIF(?,''),0,0,0,0,0,0,0)")
        .Bind(known, run.uid, run.started_utc, run.finished_utc, run.wall_s, run.jobs, run.label,
              run.host, run.program, run.shard, CoversText(run))
        .Execute();
    report->run.id = db_->last_id();
    std::map<std::string, std::string> versions;
    for (const CaseResult& result : report->cases) {
      versions.insert(result.versions.begin(), result.versions.end());
    }
    Statement insert(db_, "INSERT INTO version VALUES(?,?,?)");
    for (const auto& [name, version] : versions) {
      insert.Bind(report->run.id, name, version).Execute();
    }
  }

  // Number of the run that is in the history already, whose results go; 0 if it is new.
  long ForgetRun(const std::string& uid) {
    Statement find(db_, "SELECT id FROM run WHERE uid = ?");
    if (!find.Bind(uid).Step()) return 0;
    const long run = find.Integer(0);
    for (const char* table : {"golden", "metric", "drift"}) {
      Statement(db_, fmt::format("DELETE FROM {} WHERE result IN (SELECT id FROM result WHERE "
                                 "run = ?)",
                                 table))
          .Bind(run)
          .Execute();
    }
    for (const char* table : {"result", "version"}) {
      Statement(db_, fmt::format("DELETE FROM {} WHERE run = ?", table)).Bind(run).Execute();
    }
    return run;
  }

  void FinishRun(const RegressReport& report) {
    const Counts counts = CountCases(report);
    Statement(db_,
              "UPDATE run SET exit_code=?, total=?, as_expected=?, ran=?, compared=?, verified=?, "
              "drifted=? WHERE id=?")
        .Bind(ExitCodeOf(report), counts.total, counts.as_expected, counts.ran, counts.compared,
              counts.verified, counts.drifted, report.run.id)
        .Execute();
  }

  long ScenarioId(const std::string& key) {
    Statement find(db_, "SELECT id FROM scenario WHERE key = ?");
    if (find.Bind(key).Step()) return find.Integer(0);
    Statement(db_, "INSERT INTO scenario(key) VALUES(?)").Bind(key).Execute();
    return db_->last_id();
  }

  // Baselines start with this run; 0: with the first.
  long AcceptedRun(long scenario) {
    Statement find(db_, "SELECT MAX(run) FROM accepted WHERE scenario = ?");
    return find.Bind(scenario).Step() ? find.Integer(0) : 0;
  }

  std::vector<PastValue> Past(long scenario, long since, const std::string& metric) {
    // Newest first.
    Statement select(db_,
                     "SELECT r.run, m.value, r.status = 'as_expected' AND m.pass, m.drifted AND "
                     "r.run > ?2 FROM result r JOIN metric m ON m.result = r.id WHERE r.scenario = "
                     "?1 AND r.run >= ?2 AND m.name = ?3 ORDER BY r.run DESC LIMIT ?4");
    select.Bind(scenario, since, metric, kPastRuns);
    std::vector<PastValue> past;
    while (select.Step()) {
      past.push_back(
          {select.Integer(0), select.Real(1), select.Integer(2) != 0, select.Integer(3) != 0});
    }
    std::reverse(past.begin(), past.end());
    return past;
  }

  void FindDrifts(long scenario, long since, CaseResult* result) {
    result->drifts.clear();
    if (result->failed()) return;
    for (const auto& [name, metric] : result->metrics) {
      if (metric.limit && !metric.pass) continue;  // a case that must fail
      const std::vector<PastValue> past = Past(scenario, since, name);
      const auto found = FindDrift(past, metric.value, RuleAfter(since));
      if (!found) continue;
      Drift drift{name, "", metric.value, found->baseline, found->since_run, ""};
      if (found->since_run != 0) drift.since = DescribeRun(db_, found->since_run);
      drift.text = fmt::format(
          "{} is {:.2e}, {:.0f} times the median {:.2e} of {} good runs (reported above {:.1e}{})",
          QuantityText(name), metric.value, metric.value / found->baseline, found->baseline,
          found->good_runs, found->threshold,
          metric.limit ? fmt::format(", limit {:.1e}", *metric.limit) : ", no limit");
      result->drifts.push_back(std::move(drift));
    }
  }

  // An accepted run is a baseline by itself.
  DriftRule RuleAfter(long since) const {
    DriftRule rule = options_.rule;
    if (since != 0) rule.min_runs = 1;
    return rule;
  }

  // Against the last good run with traces: a step is reported once, in the run that took it.
  void FindMovement(long scenario, long since, const GoldenTraces& now, CaseResult* result) {
    if (result->failed()) return;
    Statement last(db_,
                   "SELECT r.id, r.run, r.inputs FROM result r WHERE r.scenario = ? AND "
                   "r.run >= ? AND r.status = 'as_expected' AND EXISTS(SELECT 1 FROM golden g "
                   "WHERE g.result = r.id) ORDER BY r.run DESC LIMIT 1");
    if (!last.Bind(scenario, since).Step()) return;
    const std::string who = AttributeMovement(LoadGolden(db_, last.Integer(0)), now);
    if (who.empty()) return;
    const bool changed = last.Text(2) != result->inputs;
    Drift drift;
    drift.metric = "traces";
    drift.text = fmt::format(
        "drive forces: {} since {}; {}", who, DescribeRun(db_, last.Integer(1)),
        changed ? "the scenario or model file changed" : "scenario and model files are the same");
    result->drifts.push_back(std::move(drift));
  }

  void FillCourse(long scenario, CaseResult* result) {
    result->course.clear();
    const auto* key = KeyMetric(*result);
    if (key == nullptr) return;
    Statement select(db_,
                     "SELECT m.value FROM result r JOIN metric m ON m.result = r.id "
                     "WHERE r.scenario = ? AND m.name = ? ORDER BY r.run DESC LIMIT ?");
    select.Bind(scenario, key->first, options_.course_runs - 1);
    while (select.Step()) result->course.push_back(select.Real(0));
    std::reverse(result->course.begin(), result->course.end());
    result->course.push_back(key->second.value);
  }

  // When a scenario that failed was last as expected, and what its failed checks were then.
  void FillPast(long scenario, long run, CaseResult* result) {
    result->past = {};
    if (!result->failed()) return;
    Statement count(db_, "SELECT COUNT(*) FROM result WHERE scenario = ? AND run < ?");
    if (count.Bind(scenario, run).Step()) result->past.runs = count.Integer(0);
    Statement good(db_,
                   "SELECT id, run FROM result WHERE scenario = ? AND run < ? AND "
                   "status = 'as_expected' ORDER BY run DESC LIMIT 1");
    if (!good.Bind(scenario, run).Step()) return;
    result->past.good_run = good.Integer(1);
    result->past.when = DescribeRun(db_, good.Integer(1));
    Statement value(db_, "SELECT value FROM metric WHERE result = ? AND name = ?");
    for (const auto* check : FailedChecks(*result)) {
      if (value.Bind(good.Integer(0), check->first).Step()) {
        result->past.values[check->first] = value.Real(0);
      }
    }
  }

  // What else changed since the newest good run: where a scenario fails, or began to drift.
  void FillChanges(long scenario, long run, long id, CaseResult* result) {
    result->changes.clear();
    const bool drifts = std::ranges::any_of(
        result->drifts, [](const Drift& drift) { return drift.since_run == 0; });
    if (!result->failed() && !drifts) return;
    Statement good(db_,
                   "SELECT id, run FROM result WHERE scenario = ? AND run < ? AND "
                   "status = 'as_expected' ORDER BY run DESC LIMIT 1");
    if (!good.Bind(scenario, run).Step()) return;
    result->changes = ChangesOfResult(db_, good.Integer(0), id);
    const Changes of_run = ChangesOfRun(db_, good.Integer(1), run);
    result->changes.insert(result->changes.end(), of_run.begin(), of_run.end());
    if (result->changes.empty()) {
      result->changes.emplace_back("nothing in limits, input files, program or machine");
    }
  }

  long InsertResult(long run, long scenario, const CaseResult& result) {
    Statement(db_,
              "INSERT INTO result(run, scenario, status, verdict, exit_code, reason, inputs, "
              "wall_s, cpu_s, peak_kib) VALUES(?,?,?,?,?,?,?,?,?,?)")
        .Bind(run, scenario, ToText(result.status), result.verdict, result.exit_code, result.reason,
              result.inputs, result.cost.wall_s, result.cost.cpu_s, result.cost.peak_kib)
        .Execute();
    const long id = db_->last_id();
    Statement metric(db_, "INSERT INTO metric VALUES(?,?,?,?,?,?)");
    for (const auto& [name, value] : result.metrics) {
      const bool drifted = std::any_of(result.drifts.begin(), result.drifts.end(),
                                       [&name = name](const Drift& d) { return d.metric == name; });
      metric.Bind(id, name, value.value, value.limit, value.pass || !value.limit, drifted)
          .Execute();
    }
    Statement input(db_, "INSERT OR IGNORE INTO input_file VALUES(?,?,?)");
    for (const InputFile& file : result.input_files) {
      input.Bind(result.inputs, file.file, file.fingerprint).Execute();
    }
    Statement drift(db_, "INSERT INTO drift VALUES(?,?,?,?,?,?)");
    for (const Drift& d : result.drifts) {
      drift.Bind(id, d.metric, d.value, d.baseline, d.since_run == 0 ? run : d.since_run, d.text)
          .Execute();
    }
    return id;
  }

  void InsertGolden(long result, const GoldenTraces& traces) {
    Statement find(db_, "SELECT id FROM trace WHERE digest = ? AND bytes = ?");
    Statement insert(db_, "INSERT INTO trace(digest, bytes) VALUES(?,?)");
    Statement link(db_, "INSERT INTO golden VALUES(?,?,?)");
    for (const auto& [witness, trace] : traces) {
      const std::string bytes = Encode(trace);
      Fingerprint fingerprint;
      fingerprint.Add(bytes);
      const std::string digest = fingerprint.Text();
      long id = 0;
      if (find.Bind(digest, Blob{bytes}).Step()) {
        id = find.Integer(0);
      } else {
        insert.Bind(digest, Blob{bytes}).Execute();
        id = db_->last_id();
      }
      link.Bind(result, witness, id).Execute();
    }
  }

  // The newest runs of each scenario keep their traces.
  void DropOldGolden() {
    Statement(db_,
              "DELETE FROM golden WHERE result IN (SELECT id FROM (SELECT r.id, ROW_NUMBER() OVER "
              "(PARTITION BY r.scenario ORDER BY r.run DESC) AS age FROM result r WHERE EXISTS("
              "SELECT 1 FROM golden g WHERE g.result = r.id)) WHERE age > ?)")
        .Bind(options_.golden_runs)
        .Execute();
    db_->Run("DELETE FROM trace WHERE id NOT IN (SELECT trace FROM golden)");
  }

  Database* db_;
  const HistoryOptions& options_;
};

std::string AppendOnce(const std::string& path, const std::map<std::string, GoldenTraces>& goldens,
                       RegressReport* report, const HistoryOptions& options, Database* database) {
  database->Run("PRAGMA journal_mode = WAL");
  database->Run("PRAGMA synchronous = NORMAL");
  // Not while a run is entered anew: what was accepted refers to its number, which stays.
  database->Run("PRAGMA foreign_keys = OFF");
  database->Run("BEGIN IMMEDIATE");
  if (!database->ok()) return database->trouble();
  if (std::string trouble = PrepareSchema(path, database); !trouble.empty()) return trouble;
  RegressReport judged = *report;
  Appender(database, options).Append(goldens, &judged);
  database->Run("COMMIT");
  if (!database->ok()) return database->trouble();  // closing rolls back
  *report = std::move(judged);
  return "";
}

}  // namespace

std::string CheckHistory(const std::string& path) {
  std::error_code error;
  if (path.empty()) return "";
  if (!fs::exists(path, error)) {
    fs::path folder = fs::absolute(path, error).parent_path();
    while (!fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
    if (!fs::is_directory(folder, error) || access(folder.c_str(), W_OK) != 0) {
      return fmt::format("history {}: cannot be made in {}", path, folder.string());
    }
    // Another file than the history itself, which another run may be making.
    const fs::path trial = folder / fmt::format(".history.mbverify-{}", RandomLetters());
    const int file = open(trial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0) return fmt::format("history {}: {}", path, std::strerror(errno));
    unlink(trial.c_str());
    close(file);
    return "";
  }
  if (!fs::is_regular_file(path, error)) return fmt::format("history {}: is not a file", path);
  if (access(path.c_str(), W_OK) != 0) {
    return fmt::format("history {}: {}", path, std::strerror(errno));
  }
  Database database(path, Database::Mode::kWrite);
  Statement check(&database, "PRAGMA quick_check(1)");
  const std::string state = check.Step() ? check.Text(0) : "";
  if (!database.ok()) return database.locked() ? "" : database.trouble();
  if (state != "ok") return fmt::format("history {}: is damaged: {}", path, state);
  if (std::string trouble = CheckWritable(path, &database); !trouble.empty()) return trouble;
  database.Run("BEGIN IMMEDIATE");
  database.Run("ROLLBACK");
  return database.locked() ? "" : database.trouble();
}

std::string AppendRun(const std::string& path, const std::map<std::string, GoldenTraces>& goldens,
                      RegressReport* report, const HistoryOptions& options) {
  std::error_code error;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) fs::create_directories(folder, error);
  // SQLite does not wait where waiting could be a deadlock, e.g. when two programs make the file.
  std::string trouble;
  for (int attempt = 0; attempt < kLockedAttempts; ++attempt) {
    if (attempt > 0) std::this_thread::sleep_for(kLockedPause);
    Database database(path, Database::Mode::kCreate);
    trouble = AppendOnce(path, goldens, report, options, &database);
    if (!database.locked()) break;
  }
  return trouble;
}

// What the history can be asked.

namespace {

using Json = nlohmann::ordered_json;

struct HistoryRow {
  long result = 0;
  std::string status;
  std::string key_name;  ///< of the KeyMetric(); "" without one
  double key_value = kNan;
  double wall_s = kNan;
};

// `column` of the result's KeyMetric().
std::string KeyMetricQuery(const char* column) {
  std::string names, ranks;
  for (size_t i = 0; i < KeyMetricNames().size(); ++i) {
    names += fmt::format("{}'{}'", i == 0 ? "" : ", ", KeyMetricNames()[i]);
    ranks += fmt::format(" WHEN '{}' THEN {}", KeyMetricNames()[i], i);
  }
  return fmt::format(
      "(SELECT m.{} FROM metric m WHERE m.result = r.id AND m.name IN ({}) "
      "ORDER BY CASE m.name{} END LIMIT 1)",
      column, names, ranks);
}

std::map<std::string, HistoryRow> RowsOf(Database* database, long run) {
  Statement select(database,
                   fmt::format("SELECT s.key, r.id, r.status, {}, {}, r.wall_s FROM result r "
                               "JOIN scenario s ON s.id = r.scenario WHERE r.run = ?",
                               KeyMetricQuery("name"), KeyMetricQuery("value")));
  select.Bind(run);
  std::map<std::string, HistoryRow> rows;
  while (select.Step()) {
    rows[select.Text(0)] = {select.Integer(1), select.Text(2), select.Text(3), select.Real(4),
                            select.Real(5)};
  }
  return rows;
}

std::string Value(double value) { return std::isnan(value) ? "-" : fmt::format("{:.2e}", value); }

std::string RunLine(Database* database, long run) {
  Statement select(database, "SELECT started_utc, label, program FROM run WHERE id = ?");
  if (!select.Bind(run).Step()) return "";
  const std::string label = OneLine(select.Text(1));
  return fmt::format("run {}: {}{}, {}\n", run, OneLine(select.Text(0)),
                     label.empty() ? "" : ", " + label, OneLine(select.Text(2)));
}

constexpr size_t kFlippedNamed = 3;

// Checks that passed in one run and fail in the other, those farthest above their limit first.
Changes FlippedChecks(Database* database, long a, long b) {
  Statement select(database,
                   "SELECT n.name, o.value, n.value, n.upper_limit, n.pass FROM metric o "
                   "JOIN metric n ON n.name = o.name WHERE o.result = ? AND n.result = ? AND "
                   "o.pass <> n.pass ORDER BY n.pass, n.value / n.upper_limit DESC");
  select.Bind(a, b);
  Changes changes;
  size_t more = 0;
  while (select.Step()) {
    more += changes.size() == kFlippedNamed ? 1 : 0;
    if (changes.size() == kFlippedNamed) continue;
    changes.push_back(fmt::format("{}: {} → {}, limit {}: {}", QuantityText(select.Text(0)),
                                  Value(select.Real(1)), Value(select.Real(2)),
                                  Value(select.Real(3)), select.Integer(4) != 0 ? "ok" : "FAIL"));
  }
  if (more > 0) changes.push_back(fmt::format("and {} more checks", more));
  return changes;
}

// A scenario in both runs, or in one.
struct Compared {
  std::string key;
  const HistoryRow *a = nullptr, *b = nullptr;
  std::string moved;  ///< which witness
  Changes checks;     ///< that passed and fail, or the other way round
  Changes changes;    ///< what else is not the same

  [[nodiscard]] bool changed() const {
    return a == nullptr || b == nullptr || a->status != b->status || !moved.empty() ||
           !checks.empty() || !changes.empty() || a->key_name != b->key_name ||
           IsOther(a->key_value, b->key_value);
  }
};

std::vector<Compared> Pair(Database* database, const std::map<std::string, HistoryRow>& rows_a,
                           const std::map<std::string, HistoryRow>& rows_b) {
  std::vector<Compared> all;
  for (const auto& [key, row] : rows_b) {
    Compared& compared = all.emplace_back();
    compared.key = key;
    compared.b = &row;
    const auto before = rows_a.find(key);
    if (before == rows_a.end()) continue;
    compared.a = &before->second;
    const long a = before->second.result, b = row.result;
    compared.moved = AttributeMovement(LoadGolden(database, a), LoadGolden(database, b));
    compared.checks = FlippedChecks(database, a, b);
    compared.changes = ChangesOfResult(database, a, b);
  }
  for (const auto& [key, row] : rows_a) {
    if (rows_b.contains(key)) continue;
    Compared& compared = all.emplace_back();
    compared.key = key;
    compared.a = &row;
  }
  return all;
}

std::string CompareText(const Compared& compared, long run_a, long run_b) {
  if (compared.a == nullptr || compared.b == nullptr) {
    return fmt::format("  {:<52}  only in run {}\n", OneLine(compared.key),
                       compared.a == nullptr ? run_b : run_a);
  }
  const HistoryRow &a = *compared.a, &b = *compared.b;
  std::string line =
      fmt::format("  {:<52}{:>10} → {:<10}{:>7.1f} s → {:.1f} s", OneLine(compared.key),
                  Value(a.key_value), Value(b.key_value), a.wall_s, b.wall_s);
  if (!compared.changed()) return line + "  same\n";
  if (a.status != b.status) line += fmt::format("  {} → {}", OneLine(a.status), OneLine(b.status));
  const double ratio = b.key_value / a.key_value;
  if (std::isfinite(ratio) && IsOther(a.key_value, b.key_value)) {
    line += fmt::format("  ×{:.3g}", ratio);
  }
  if (!compared.moved.empty()) line += "  " + OneLine(compared.moved);
  line += "\n";
  if (!b.key_name.empty() && !b.key_name.ends_with(".force_nrmse")) {
    line += fmt::format("      the value is: {}\n", OneLine(QuantityText(b.key_name)));
  }
  for (const Changes* texts : {&compared.checks, &compared.changes}) {
    for (const std::string& text : *texts) line += "      " + OneLine(text) + "\n";
  }
  return line;
}

// Null where a run does not have the scenario.
Json ComparedJson(const Compared& compared) {
  const auto side = [](const HistoryRow* row) {
    if (row == nullptr) return Json();
    return Json({{"status", row->status},
                 {"quantity", row->key_name.empty() ? "" : QuantityText(row->key_name)},
                 {"force_nrmse", Number(row->key_value)},
                 {"wall_s", Number(row->wall_s)}});
  };
  Json json = {{"scenario", compared.key},
               {"changed", compared.changed()},
               {"a", side(compared.a)},
               {"b", side(compared.b)}};
  if (compared.a != nullptr && compared.b != nullptr) {
    json["moved"] = compared.moved;
    json["checks"] = compared.checks;
    json["changes"] = compared.changes;
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
                        select.Integer(0), OneLine(select.Text(1)),
                        fmt::format("{}/{}", select.Integer(2), select.Integer(3)),
                        select.Integer(4), select.Integer(5), select.Integer(6), select.Integer(7),
                        select.Real(8), label.empty() ? "" : OneLine(label) + ", ",
                        OneLine(select.Text(10)), shard.empty() ? "" : ", shard " + OneLine(shard));
  }
  return {text, database.trouble(), Dump({{"runs", std::move(runs)}})};
}

HistoryText CompareRuns(const std::string& path, const std::string& run_a, const std::string& run_b,
                        bool only_changed) {
  Database database(path, Database::Mode::kRead);
  if (auto trouble = CheckSchema(path, &database); !trouble.empty()) return {"", trouble};
  const long a = FindRun(&database, run_a), b = FindRun(&database, run_b);
  for (const auto& [id, name] : {std::pair{a, run_a}, std::pair{b, run_b}}) {
    if (id == 0) return {"", fmt::format("history {}: there is no run '{}'", path, name)};
  }
  std::string text = RunLine(&database, a) + RunLine(&database, b);
  const Changes of_run = ChangesOfRun(&database, a, b);
  for (const std::string& change : of_run) text += "  " + OneLine(change) + "\n";
  const auto rows_a = RowsOf(&database, a), rows_b = RowsOf(&database, b);
  text += fmt::format("  {:<52}{:>23}{:>18}\n", "scenario", "force error (RMS)", "wall time");
  Json scenarios = Json::array();
  size_t same = 0;
  for (const Compared& compared : Pair(&database, rows_a, rows_b)) {
    same += compared.changed() ? 0 : 1;
    if (only_changed && !compared.changed()) continue;
    text += CompareText(compared, a, b);
    scenarios.push_back(ComparedJson(compared));
  }
  if (only_changed) {
    text += fmt::format("  {} scenario{} without a change\n", same, same == 1 ? "" : "s");
  }
  return {text, database.trouble(),
          Dump({{"run_a", a},
                {"run_b", b},
                {"changes", of_run},
                {"scenarios", std::move(scenarios)},
                {"same", same}})};
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
