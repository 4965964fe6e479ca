// What repeating the results of an archive gave (`mbverify package --check`), and its writers.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "features/paper/rerun.h"

namespace mbv {

/// How a packed file and its repetition compare.
enum class RerunOutcome {
  kSame,       ///< byte for byte
  kWithin,     ///< other bytes, within the limits
  kNotJudged,  ///< other bytes, which follow from results that are judged, or were drawn otherwise
  kDiffers,
};
[[nodiscard]] const char* ToText(RerunOutcome outcome);  ///< "same", "within", …

struct RerunFile {
  std::string path;
  RerunOutcome outcome = RerunOutcome::kDiffers;
  std::string why;                   ///< one sentence; "" of the same
  std::vector<RerunSignal> signals;  ///< of those that were judged
};

/// The signal that takes most of its tube; what is not a number is worst. Null without signals.
[[nodiscard]] const RerunSignal* WorstSignal(const std::vector<RerunSignal>& signals);

/// One scenario or study.
struct RerunScenario {
  std::string file, kind;
  int exit_code = 4, packed_exit_code = 4;
  std::string verdict, packed_verdict;
  std::string failure;  ///< why it could not be repeated; "" otherwise
  std::vector<RerunFile> files;

  [[nodiscard]] bool agrees() const;
};

/// A program or library of another version than that of the archive.
struct OtherVersion {
  std::string name, packed, here;
};

struct RerunReport {
  std::string archive;
  std::vector<OtherVersion> other_versions;
  std::vector<RerunScenario> scenarios;

  /// 0 everything is the same or within its limits, 1 something differs.
  [[nodiscard]] int exit_code() const;
};

/// For a terminal; `all`: every file and signal, not only what is not the same, and the worst of
/// each.
[[nodiscard]] std::string ToText(const RerunReport& report, bool all);
/// JSON, schema "mbverify.verify/1".
[[nodiscard]] std::string ToJson(const RerunReport& report, int exit_code);

// summary.json of an archive against that of its repetition.

/// `exact`: both are made of the same traces by the same versions, so that every byte must be the
/// same; else verdict and exit code must be, and no check may move by more than kRerunShare of its
/// limit. Names the first value that differs.
[[nodiscard]] RerunFile CompareSummaries(const std::string& path, const std::string& packed,
                                         const std::string& rerun, bool exact);

}  // namespace mbv
