// Appends a run to the history, judging it against the runs before.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>

#include "core/files.h"
#include "regress/history.h"
#include "regress/history_schema.h"
#include "regress/missing.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

// Runs of a scenario that are looked at: enough for a window of good ones with failed nights
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
                     "SELECT r.run, m.value, r.status = 'as_expected' AND m.pass, "
                     "m.drifted AND r.run > ?2 FROM result r JOIN metric m ON m.result = r.id "
                     "WHERE r.scenario = ?1 AND r.run >= ?2 AND m.name = ?3 "
                     "ORDER BY r.run DESC LIMIT ?4");
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
          name, metric.value, metric.value / found->baseline, found->baseline, found->good_runs,
          found->threshold,
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

  // Against the last good run with traces: a step is told once, in the run that took it.
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
                       RegressReport* report, const HistoryOptions& options) {
  Database database(path, Database::Mode::kCreate);
  database.Run("PRAGMA journal_mode = WAL");
  database.Run("PRAGMA synchronous = NORMAL");
  // Not while a run is entered anew: what was accepted refers to its number, which stays.
  database.Run("PRAGMA foreign_keys = OFF");
  database.Run("BEGIN IMMEDIATE");
  if (!database.ok()) return database.trouble();
  if (std::string trouble = PrepareSchema(path, &database); !trouble.empty()) return trouble;
  RegressReport judged = *report;
  Appender(&database, options).Append(goldens, &judged);
  database.Run("COMMIT");
  if (!database.ok()) return database.trouble();  // closing rolls back
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
    // Another file than the history itself, which another night may be making.
    const fs::path trial = folder / fmt::format(".history.mbverify-{}", RandomLetters());
    const int file = open(trial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0) return fmt::format("history {}: {}", path, std::strerror(errno));
    unlink(trial.c_str());
    close(file);
    return "";
  }
  if (!fs::is_regular_file(path, error)) return fmt::format("history {}: is no file", path);
  if (access(path.c_str(), W_OK) != 0) {
    return fmt::format("history {}: {}", path, std::strerror(errno));
  }
  Database database(path, Database::Mode::kWrite);
  const auto busy = [&] { return database.trouble().ends_with("locked"); };  // it will be free
  Statement check(&database, "PRAGMA quick_check(1)");
  const std::string state = check.Step() ? check.Text(0) : "";
  if (!database.ok()) return busy() ? "" : database.trouble();
  if (state != "ok") return fmt::format("history {}: is damaged: {}", path, state);
  if (std::string trouble = CheckWritable(path, &database); !trouble.empty()) return trouble;
  database.Run("BEGIN IMMEDIATE");
  database.Run("ROLLBACK");
  return busy() ? "" : database.trouble();
}

std::string AppendRun(const std::string& path, const std::map<std::string, GoldenTraces>& goldens,
                      RegressReport* report, const HistoryOptions& options) {
  std::error_code error;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty()) fs::create_directories(folder, error);
  // SQLite does not wait where waiting could be a deadlock, e.g. when two programs make the file.
  std::string trouble;
  for (int attempt = 0; attempt < kLockedAttempts; ++attempt) {
    trouble = AppendOnce(path, goldens, report, options);
    if (!trouble.ends_with("locked")) break;
    std::this_thread::sleep_for(kLockedPause);
  }
  return trouble;
}

}  // namespace mbv
