// The history of regression runs: one SQLite file, schema in docs/how-to/regression.md.
//
// A run is appended in one transaction (write-ahead log, waiting for other writers), so the file
// holds whole runs only, whatever is killed when.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "features/regress/case_result.h"
#include "features/regress/database.h"
#include "features/regress/golden.h"

namespace mbv {

struct HistoryOptions {
  DriftRule rule;
  int course_runs = 30;  ///< length of the course given back for each scenario
  int golden_runs = 50;  ///< runs whose golden traces are kept
};

/// Judges a run against the history and appends it; an entry of the same uid is replaced. Fills the
/// report's run id, drifts, courses, the past of what failed, and what is missing: scenarios that
/// the run covers and does not have, but an earlier run had (of runs that do not say what they
/// cover, the newest one counts). `goldens` by scenario key. "" or what went wrong; then
/// nothing was appended.
[[nodiscard]] std::string AppendRun(const std::string& path,
                                    const std::map<std::string, GoldenTraces>& goldens,
                                    RegressReport* report, const HistoryOptions& options = {});

/// Whether AppendRun() could append: "" or why not. Changes nothing; a file that is not there yet
/// is fine if it can be made.
[[nodiscard]] std::string CheckHistory(const std::string& path);

/// Text, what went wrong with it, and the same as JSON where there is one.
struct HistoryText {
  std::string text, trouble, json = {};
};

/// A table of the runs, newest last.
[[nodiscard]] HistoryText ListRuns(const std::string& path);
/// What differs between two runs: status, key metrics, cost, which witness moved, and what else
/// changed: limits, input files, program. A run is a number, "last" or "last~2".
[[nodiscard]] HistoryText CompareRuns(const std::string& path, const std::string& run_a,
                                      const std::string& run_b, bool only_changed = false);
/// One line per run, scenario and metric.
[[nodiscard]] HistoryText HistoryCsv(const std::string& path);
/// Takes what run `run` measured as right: baselines start there; what was missing in it is meant
/// to be. `key` "" means all scenarios.
[[nodiscard]] HistoryText AcceptRun(const std::string& path, const std::string& run,
                                    const std::string& key, const std::string& note);

/// Wall time of each scenario in the newest run that has it, to start long ones first.
[[nodiscard]] std::map<std::string, double> LastWallTimes(const std::string& path);

// Tables of the history.

/// PRAGMA user_version; 1 had no uid of runs, 2 not what they cover, 3 not which files were read.
inline constexpr int kHistoryVersion = 4;

/// Makes the tables where they are missing, or what an older file lacks; a newer program's file and
/// a file with other tables are trouble. Call inside a write
/// transaction. "" or what went wrong.
[[nodiscard]] std::string PrepareSchema(const std::string& path, Database* database);

/// Whether PrepareSchema() would take the file; changes nothing.
[[nodiscard]] std::string CheckWritable(const std::string& path, Database* database);

/// The same check for readers, which change nothing.
[[nodiscard]] std::string CheckSchema(const std::string& path, Database* database);

/// Number of a run given as "17", "last" or "last~1"; 0 if there is none.
[[nodiscard]] long FindRun(Database* database, const std::string& text);

/// The golden traces kept with a result.
[[nodiscard]] GoldenTraces LoadGolden(Database* database, long result);

}  // namespace mbv
