// What entries of a paper are computed from: runs of scenarios, each once, with other runs' and
// printed numbers as witnesses beside their own.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "pipeline/run_options.h"
#include "pipeline/workspace.h"
#include "scenario/paper_file.h"

namespace mbv {

class PaperRuns {
 public:
  PaperRuns(std::string model, const PaperFile& paper, ProgramConsent programs,
            ProgressFunction progress)
      : model_(std::move(model)),
        paper_(paper),
        programs_(std::move(programs)),
        progress_(std::move(progress)) {}

  /// The run of an entry's scenario with what stands beside it. Of a stiffness: its loads in the
  /// place of samples, `load` (their number) and `displacement.x` … `rotation.z`. Empty after a
  /// finding.
  [[nodiscard]] std::optional<Report> Of(const PaperEntry& entry, Diagnostics* diagnostics);
  /// The file of a scenario of this model.
  [[nodiscard]] std::string FileOf(const PlacedText& scenario) const;
  /// The workspace, computed once.
  [[nodiscard]] const WorkspaceOutcome& Workspace(Diagnostics* diagnostics);

  [[nodiscard]] int exit_code() const { return exit_code_; }  ///< the worst of all runs

 private:
  const Report* Run(const PlacedText& scenario, Diagnostics* diagnostics);
  void AddBeside(const BesideRun& beside, Report* report, Diagnostics* diagnostics);
  void AddPrinted(const PrintedNumbers& numbers, Report* report, Diagnostics* diagnostics);
  void Error(const PlacedText& at, const std::string& message, const std::string& hint,
             Diagnostics* diagnostics) const;

  std::string model_;
  const PaperFile& paper_;
  ProgramConsent programs_;
  ProgressFunction progress_;
  std::map<std::string, std::optional<Report>> runs_;  // by file
  std::optional<WorkspaceOutcome> workspace_;
  int exit_code_ = 0;
};

}  // namespace mbv
