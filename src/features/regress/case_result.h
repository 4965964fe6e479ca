// What the nightly regression knows about one scenario after running it.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/diagnostics.h"
#include "base/inputs.h"
#include "base/types.h"
#include "base/worker_pool.h"
#include "scenario/scenario.h"

namespace mbv {

/// How a scenario ended. Everything but kAsExpected is a failed scenario.
enum class CaseStatus {
  kNotRun,         ///< pessimistic start value
  kAsExpected,     ///< verdict, exit code and text are what the file's `expect:` says
  kUnexpected,     ///< ran, but they are not
  kBadInput,       ///< the file was refused, unexpectedly
  kCouldNotRun,    ///< numerical trouble, unexpectedly
  kCrashed,        ///< killed by a signal, or could not be started
  kTimedOut,       ///< killed after the time limit
  kInternalError,  ///< exit code 4 or one that mbverify does not have
};
[[nodiscard]] const char* ToText(CaseStatus status);  ///< "as_expected", "timed_out", …
/// Exit code a status asks for: 0 as expected, 1 unexpected, 2 bad input, 3 everything else.
[[nodiscard]] int ExitCodeOf(CaseStatus status);

/// One judged or only measured quantity of a scenario.
struct MetricValue {
  double value = kNan;
  std::optional<double> limit;  ///< empty: measured, not judged
  bool pass = false;
  std::string channel = {};  ///< where the value was found: a signal, an entry; "" if unknown
  double time_s = kNan;      ///< and when
};

struct Unmeasured {
  std::string what, why;
};

/// A metric that got worse inside its limit, or traces that moved.
struct Drift {
  std::string metric;      ///< check name, or "traces"
  std::string text;        ///< one sentence with numbers
  double value = kNan;     ///< now
  double baseline = kNan;  ///< median of the good runs before
  long since_run = 0;      ///< first run of the unbroken stretch; 0: this one
  std::string since;       ///< that run's date, label and versions
};

/// What the history knows of a scenario that failed.
struct PastOfFailure {
  long runs = 0;      ///< earlier runs that have it
  long good_run = 0;  ///< the newest of them in which it was as expected; 0: none
  std::string when;   ///< that run's date, label and build
  std::map<std::string, double> values;  ///< then, of the checks that fail now
};

/// What else changed between two results of a scenario, one short text each.
using Changes = std::vector<std::string>;

/// A scenario that an earlier run had and this one should have had.
struct MissingCase {
  std::string key;
  long last_run = 0;  ///< the newest run that has it
  std::string when;   ///< its date, label and build
};

struct CaseResult {
  std::string key;   ///< "stabilizing_platform/must_fail/stroke": result folder and history name
  std::string file;  ///< as found
  std::string description;
  Expectation expected;
  std::vector<InputFile> input_files;  ///< what was read for the result; empty without one
  std::string inputs;                  ///< fingerprint of these; without them of the scenario
  std::string fingerprint;             ///< of scenario, program and the options that change results

  CaseStatus status = CaseStatus::kNotRun;
  std::string reason = "was not run";  ///< one sentence to read
  std::string verdict = "not_run";
  int exit_code = -1;  ///< of the worker; -1 if it did not end by itself
  int signal = 0;      ///< that ended it

  bool ran = false;                            ///< at least one witness ran to its end
  bool compared = false;                       ///< drive forces of at least one pair of witnesses
  bool verified = false;                       ///< verdict agree, as expected
  std::map<std::string, MetricValue> metrics;  ///< by check name
  std::vector<Unmeasured> not_compared;
  std::vector<std::string> caveats;  ///< why its agreement says less than it seems to
  std::map<std::string, std::string> versions;
  bool has_folder = false;  ///< OUT/<key>/ holds a result
  bool has_report = false;  ///< and a report.html in it
  Cost cost;
  std::string log_tail;  ///< last lines the worker printed; only of failed scenarios
  bool kept = false;     ///< taken over from the interrupted run (--resume)

  PastOfFailure past;          ///< filled from the history, of failed scenarios
  Changes changes;             ///< since the last good run, of what failed or drifted in this run
  std::vector<Drift> drifts;   ///< filled from the history
  std::vector<double> course;  ///< key metric of the last runs, oldest first, this one included

  [[nodiscard]] bool failed() const { return status != CaseStatus::kAsExpected; }
};

/// Names of the metrics that may be shown first, best first: drive forces (RMS), then stiffness
/// (worst entry), then, of a motion that follows from forces, the place of an output or the
/// velocities (RMS); simulated vs analytic, then the other pairs.
[[nodiscard]] std::span<const std::string_view> KeyMetricNames();
/// The first of these that was measured; null if nothing of the kind was compared.
[[nodiscard]] const std::pair<const std::string, MetricValue>* KeyMetric(const CaseResult& result);

/// Failed checks with a limit, worst first (value over limit; a value that is not a number is
/// worst).
[[nodiscard]] std::vector<const std::pair<const std::string, MetricValue>*> FailedChecks(
    const CaseResult& result);

/// A whole regression run.
struct RunInfo {
  std::string uid;                        ///< the same run everywhere, resumed or not
  long id = 0;                            ///< in the history; 0 without one
  std::string started_utc, finished_utc;  ///< "2026-01-31T02:00:00Z"
  std::string label;                      ///< free text, e.g. a commit
  std::string host, program;              ///< program: version and fingerprint
  std::string shard;                      ///< "2/3"; "" for all
  /// Beginnings of names ("spr_tripod/", "" for all) of which it runs every scenario there is.
  std::vector<std::string> covers;
  size_t found = 0;      ///< scenarios of all shards together; 0: unknown
  bool partial = false;  ///< joined although something is missing
  double wall_s = 0.0;
  int jobs = 1;
};

struct RegressReport {
  RunInfo run;
  std::vector<CaseResult> cases;     ///< sorted by key
  std::vector<std::string> notes;    ///< trouble with history, pictures, …
  std::vector<MissingCase> missing;  ///< filled from the history
  bool fail_on_missing = false;      ///< a missing scenario is not as expected
};

/// "ran", "compared" and "verified" are counted separately.
struct Counts {
  int total = 0, as_expected = 0, ran = 0, compared = 0, verified = 0;
  int must_fail = 0;  ///< as expected, and what is expected is not "agree"
  int drifted = 0, missing = 0;
};
[[nodiscard]] Counts CountCases(const RegressReport& report);

/// Worst of all scenarios, in the order 2, 3, 1, 0; missing ones count as 1 if they are to.
[[nodiscard]] int ExitCodeOf(const RegressReport& report);

/// regress.json and the state files of single scenarios.
[[nodiscard]] std::string ToJson(const CaseResult& result);
[[nodiscard]] std::string ToJson(const RegressReport& report);
/// Empty when the text is not what ToJson() wrote.
[[nodiscard]] std::optional<CaseResult> CaseFromJson(const std::string& text);
/// The same; `damage` says what of `file` is not so.
[[nodiscard]] std::optional<RegressReport> ReportFromJson(const std::string& text,
                                                          const std::string& file = {},
                                                          std::optional<Finding>* damage = nullptr);

}  // namespace mbv
