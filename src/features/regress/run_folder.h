// The folder of a regression run: results, summaries, and .mbverify/ for everything else.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "features/regress/case_result.h"
#include "features/regress/find_cases.h"
#include "features/regress/golden.h"
#include "features/regress/regress.h"

namespace mbv {

/// In a folder whose regression run has not finished, or was killed.
inline constexpr const char* kUnfinished = "unfinished.txt";

class RunFolder {
 public:
  explicit RunFolder(std::filesystem::path out) : out_(std::move(out)) {}
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// Makes and locks the folder; removes what a killed run left half done. "" or what is wrong.
  [[nodiscard]] std::string Open();

  [[nodiscard]] const std::filesystem::path& path() const { return out_; }
  [[nodiscard]] std::filesystem::path Result(const std::string& key) const { return out_ / key; }
  /// Where a worker writes, until its result is moved to its place; and what it prints.
  [[nodiscard]] std::filesystem::path Staging(size_t job) const;
  [[nodiscard]] std::filesystem::path StagedLog(size_t job) const;
  /// Where workers keep what all of them need; it is new in each run.
  [[nodiscard]] std::filesystem::path Shared() const;

  /// The folder with a summary.json below Staging(job); empty if there is none.
  [[nodiscard]] std::optional<std::filesystem::path> FindStaged(size_t job) const;
  /// Puts a staged folder in its place whole, replacing an older result. "" or what went wrong.
  [[nodiscard]] std::string Publish(const std::filesystem::path& staged,
                                    const std::string& key) const;
  void RemoveStaging(size_t job) const;

  /// Name of a scenario's log, relative to the folder.
  [[nodiscard]] static std::string Log(const std::string& key) { return "logs/" + key + ".txt"; }
  /// Files of the regression run itself (relative names). Claim() is called with all of them before
  /// anything is written: "" or which of them are there already and are not ours.
  [[nodiscard]] std::string Claim(const std::vector<std::string>& names);
  /// "" or what went wrong; only claimed files are written.
  [[nodiscard]] std::string Write(const std::string& name, const std::string& content) const;

  /// From here on until Finished() the folder may hold results of this run beside summaries of an
  /// earlier one: a file says so, and merge takes no such folder. "" or what went wrong.
  [[nodiscard]] std::string Begin(const std::string& started_utc) const;
  void Finished() const;

  /// Identifies the run: kept with the states, so that a resumed run is the same run.
  [[nodiscard]] std::string RunId();
  // State of single scenarios, whole or not at all.
  [[nodiscard]] std::string SaveState(const CaseResult& result) const;
  [[nodiscard]] std::optional<CaseResult> LoadState(const std::string& key) const;
  void ForgetStates() const;

  [[nodiscard]] GoldenTraces Golden(const std::string& key) const;
  /// The first snapshot; empty if there is none.
  [[nodiscard]] std::optional<std::filesystem::path> Snapshot(const std::string& key) const;

 private:
  [[nodiscard]] std::filesystem::path Own() const;
  [[nodiscard]] std::filesystem::path StateFile(const std::string& key) const;

  std::filesystem::path out_;
  std::set<std::string> claimed_;  ///< the regression run's own files
  int lock_ = -1;
};

// What a regression run and a merge have in common: which files they own, and how they end.

/// Adds a line to the outcome's trouble; nothing for "".
void AddTrouble(const std::string& text, RegressOutcome* outcome);

/// Names of the files that FinishRegression() writes into --out, and the logs of `keys`.
[[nodiscard]] std::vector<std::string> RegressionFiles(const RegressOptions& options,
                                                       const std::vector<std::string>& keys);

/// Outputs that are inputs, too, as far as loading shows: "" or which.
[[nodiscard]] std::string FindClash(const RegressOptions& options,
                                    const std::vector<CaseFile>& cases);

/// Keys whose results would lie where a file of the regression run belongs (a folder of scenarios
/// named "index.html"): "" or which.
[[nodiscard]] std::string FindTaken(const RegressOptions& options,
                                    const std::vector<std::string>& keys);

/// Everything after the scenarios ran: history, summaries, files, exit code.
void FinishRegression(const RegressOptions& options, const RunFolder& folder,
                      RegressOutcome* outcome);

// Times of runs: "2026-01-31T02:00:00Z".

[[nodiscard]] std::string UtcNow();

/// Hours since 1970; NaN if it is no such time.
[[nodiscard]] double UtcHours(const std::string& utc);

}  // namespace mbv
