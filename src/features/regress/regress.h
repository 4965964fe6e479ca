// The nightly regression: all scenarios in worker processes, judged, summarised, remembered.
//
// OUT/ holds: <key>/ result folders, logs/<key>.txt, regress.json, junit.xml, summary.md,
// index.html, history.sqlite, scripts that reports share, and .mbverify/ with the list of these and
// the states for --resume. Nothing else in OUT is touched.
#pragma once

#include <csignal>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/worker_pool.h"
#include "features/regress/case_result.h"
#include "features/regress/find_cases.h"

namespace mbv {

struct RegressOptions {
  std::vector<std::string> paths = {"scenarios"};
  std::string out = "out/regress";
  std::string history;                   ///< SQLite file; "" writes none
  std::string junit;                     ///< "" is OUT/junit.xml
  std::string markdown;                  ///< "" is OUT/summary.md
  std::string json;                      ///< written by the caller; it may be no other file
  std::vector<std::string> tables = {};  ///< documents whose accuracy tables are filled
  std::string label;                     ///< kept with the run, e.g. a commit
  std::string program;                   ///< version text; its file's fingerprint is added
  Shard shard;
  bool resume = false;
  bool pictures = true;
  int jobs = 1;                  ///< worker processes at once, >= 1
  double timeout_s = 300.0;      ///< of one scenario, > 0
  bool fail_on_missing = false;  ///< exit code 1 if a scenario of an earlier run is gone
  bool partial = false;          ///< merge joins what there is
  /// Program and arguments; "run FILE --out DIR" is added, and the options.
  std::vector<std::string> worker = {ProgramToStart()};
  /// "{up}" in them is the way from a result's folder to OUT.
  std::vector<std::string> worker_options;
  /// By scenario file: the fingerprint of its programs, which its worker may run.
  std::map<std::string, std::string> agreed_programs = {};
  std::map<std::string, std::string> shared_files;   ///< further files in OUT: content by name
  const volatile std::sig_atomic_t* stop = nullptr;  ///< not 0: stop the workers and return
};

/// What runs now and what is done, for a terminal.
struct RegressProgress {
  std::function<void(size_t cases, size_t kept)> begin;
  std::function<void(const std::string& key)> started;
  std::function<void(const CaseResult& result)> ended;
  std::function<void()> tick;
};

struct RegressOutcome {
  int exit_code = 4;    ///< 0 all as expected, 1 some not, 2 bad input, 3 some could not run
  std::string trouble;  ///< why nothing was run, or "interrupted"
  RegressReport report;
  std::vector<std::string> files;  ///< summaries that were written
};

/// Runs and writes everything. Never throws for what scenarios or workers do.
[[nodiscard]] RegressOutcome Regress(const RegressOptions& options,
                                     const RegressProgress& progress);

/// Names of scripts that reports share: "report-0123456789abcdef.js".
[[nodiscard]] bool IsSharedScript(const std::string& name);

/// Joins the folders of shards into one: result folders are copied, and all summaries are written
/// as if one run had done it. They must be all shards of one regression run: exit code 3 if some is
/// missing, 2 if they are of different regression runs, labels or programs. RegressOptions::partial
/// joins whatever runs of different scenarios there are, and notes what is missing.
[[nodiscard]] RegressOutcome MergeRuns(const std::vector<std::string>& folders,
                                       const RegressOptions& options);

// A worker's end, output and summary.json → CaseResult.

/// Judges against the file's `expect:`. `output` is all the worker printed; `summary` its
/// summary.json, empty if it left none.
[[nodiscard]] CaseResult JudgeCase(const CaseFile& file, const WorkerEnd& end, double timeout_s,
                                   const std::string& output,
                                   const std::optional<std::string>& summary);

/// Puts what a worker's inputs.json states into its result; "" or why it is none.
[[nodiscard]] std::string AddInputs(const std::string& inputs, CaseResult* result);

}  // namespace mbv
