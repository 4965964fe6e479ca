// What repeating the results of an archive gave (`mbverify package --check`), and its writers.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "comparison/comparison.h"
#include "features/paper/package_manifest.h"

namespace mbv {

// A result against its repetition, by the same program on another day or machine: judged by the
// tubes that tables are judged by (table_tube.h), column by column.
//
// A repetition differs by round-off alone: libraries of mathematics round differently on other
// machines. Computations without an engine may differ by as much as two of them may (the scenario's
// own limits, far above round-off). The limits of a simulation stand for what its engine's model
// leaves out; a repetition leaves out the same and may use a hundredth of them, so that no check
// moves by more than a hundredth of its limit. A limit that is switched off is the default one
// here.

/// The share of an engine's limits that a repetition may use.
inline constexpr double kRerunShare = 0.01;

/// The limits that repetitions are judged by.
[[nodiscard]] CheckLimits RerunLimits(const CheckLimits& limits);

/// One signal.
struct RerunSignal {
  std::string signal;      ///< "motor.force.simulated"
  double relative = kNan;  ///< largest difference over the signal's largest value; 0/0 is 0
  double use = kNan;       ///< share of its tube that it takes: at most 1; NaN is outside
  double time_s = kNan;    ///< of the largest difference; NaN where there is no time
  [[nodiscard]] bool inside() const { return use <= 1.0; }
};

/// Every channel of `packed` against the one of the same name; both as files show them
/// (AsShown()), with the same channels and times. What neither knows (NaN) is the same.
[[nodiscard]] std::vector<RerunSignal> CompareReruns(const ComparisonInput& input, Trace packed,
                                                     Trace rerun, LimitColumn column);

/// Two columns of numbers by one limit of their largest difference: over the column's largest
/// value, or as it is (`absolute`).
[[nodiscard]] RerunSignal CompareColumns(const std::string& name, const std::vector<double>& packed,
                                         const std::vector<double>& rerun, double limit,
                                         bool absolute = false);

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
  std::string why = {};                   ///< one sentence; "" of the same
  std::vector<RerunSignal> signals = {};  ///< of those that were judged
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
  std::vector<PackedFile> inputs = {};  ///< of the archive
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
