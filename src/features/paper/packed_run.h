// A scenario of an archive, run in the folder that the archive's files lie in: paths in its results
// are those of the archive, wherever that folder is.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "features/paper/package_manifest.h"
#include "features/paper/rerun_report.h"
#include "verify/check_file.h"
#include "verify/program_consent.h"
#include "verify/run_witnesses.h"

namespace mbv {

inline constexpr const char* kResultsFolder = "results";
inline constexpr const char* kFiguresFolder = "figures";

struct PackedRunOptions {
  std::filesystem::path folder;      ///< of the archive: holds inputs/, gets results/ and figures/
  std::vector<PackedMeshes> meshes;  ///< relative to it
  bool page = true;                  ///< report.html
  bool figures = true;
  ProgramConsent programs = {.archived = true};  ///< that scenarios name
};

/// A case of the benchmark, which `mbverify benchmark` runs; here by the engines that need no other
/// program.
[[nodiscard]] bool IsBenchmarkCase(const DocumentKind& kind);

/// What became of it.
struct PackedRun {
  PackedScenario scenario;        ///< file and kind as asked for, the rest as it ran
  std::vector<Finding> findings;  ///< bad input and warnings
  std::vector<RerunFile> files;   ///< of a repetition that was judged
  std::string failure;            ///< why it gave nothing; "" otherwise
  /// The programs that it names, each with why it may run (ProgramList::Lines()).
  std::vector<std::string> programs;
  bool refused = false;  ///< because of them
};

/// Results of an archive that a repetition is judged by.
struct PackedTruth {
  PackedScenario scenario;
  std::filesystem::path folder;    ///< where they are unpacked
  std::vector<std::string> files;  ///< paths in the archive, and below `folder`
  bool same_versions = true;
};

/// Runs a scenario (`file` relative to the folder) in a process of its own, which alone changes its
/// current folder; what it read must lie below. With `truth` its results are judged by
/// JudgeReruns().
[[nodiscard]] PackedRun RunPacked(const std::string& file, const PackedRunOptions& options,
                                  const PackedTruth* truth = nullptr);

/// Files below a folder of the archive, by path in the archive; hidden ones are left out.
[[nodiscard]] std::map<std::string, std::string> FilesOf(const std::filesystem::path& archive,
                                                         const std::string& folder);

template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<RerunSignal>& signal) {
  visit(signal.signal), visit(signal.relative), visit(signal.use), visit(signal.time_s);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<RerunFile>& file) {
  visit(file.path), visit(file.outcome), visit(file.why), visit(file.signals);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<PackedScenario>& scenario) {
  visit(scenario.file), visit(scenario.kind), visit(scenario.results), visit(scenario.figures);
  visit(scenario.exit_code), visit(scenario.verdict), visit(scenario.description);
  visit(scenario.reason);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<PackedRun>& run) {
  visit(run.scenario), visit(run.findings), visit(run.files), visit(run.failure);
  visit(run.programs), visit(run.refused);
}

// The result files of a packed scenario against those of its repetition.

/// Path in the archive → content.
using PackedResults = std::map<std::string, std::string>;

/// One outcome per file of either side, by path. Traces of motions, stiffnesses and points of
/// studies are judged by RerunLimits() of the scenario; summaries by their checks; what is made of
/// those must be the same where they are. `same_versions`: of the program and its libraries. The
/// scenario is loaded as packed, relative to the current folder.
[[nodiscard]] std::vector<RerunFile> JudgeReruns(const PackedScenario& scenario,
                                                 const PackedResults& packed,
                                                 const PackedResults& rerun, bool same_versions);

}  // namespace mbv
