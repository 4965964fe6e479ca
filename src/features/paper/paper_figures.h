// The figures and tables of a paper (models/NAME/paper.yaml), computed anew.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "features/paper/figures.h"
#include "features/paper/paper_file.h"
#include "features/workspace/workspace.h"
#include "math/plot.h"
#include "report/report.h"
#include "verify/run_options.h"

namespace mbv {

// What a paper says of a figure, measured on what was computed for it.

struct StatedResult {
  std::string says, where;
  double low = kNan;       ///< of a range
  double measured = kNan;  ///< of a range the largest
  double printed = kNan;   ///< NaN: the paper prints no number
  std::string unit;        ///< as files name it: "kN", "%"; "" for numbers

  [[nodiscard]] double deviation() const { return measured - printed; }
};

/// Statements about signals. Witnesses, signals and units that the run does not have are findings
/// in `file`.
[[nodiscard]] StatedResult MeasureSignals(const PaperStatement& statement, const Report& report,
                                          const std::string& file, Diagnostics* diagnostics);
/// Statements about maps, which are square where they are mirrored.
[[nodiscard]] StatedResult MeasureMaps(const PaperStatement& statement,
                                       const std::vector<MapPlot>& maps, const std::string& file,
                                       Diagnostics* diagnostics);

/// "“agree to 0.1 kN” (section 4): printed 0.1 kN, computed 46.6 kN, deviation +46.5 kN".
[[nodiscard]] std::string ResultText(const StatedResult& result);

/// An entry as it came out.
struct PaperResult {
  std::string name, title;
  std::string from;     ///< what it is computed from: "scenario stabilizing_platform/sea_state"
  std::string note;     ///< its own words
  std::string caption;  ///< the note with what the paper says and by how much that is off
  std::string differs;  ///< why the printed one does
  std::vector<std::string> audit;  ///< rows of the equation audit
  std::vector<StatedResult> said;
  std::string table;               ///< Markdown; "" of a figure
  std::vector<std::string> files;  ///< names
};

struct PaperOutcome {
  int exit_code = 4;  ///< the worst of all runs; 2 after findings
  Diagnostics diagnostics;
  std::string model, source;
  std::vector<PaperResult> results;
  /// Entries that were left out, and why: figures that show nothing to compute.
  std::vector<std::pair<std::string, std::string>> left_out;
  std::vector<std::pair<std::string, std::string>> files;  ///< name, content
};

/// Names of models with a paper.yaml, sorted.
[[nodiscard]] std::vector<std::string> PaperModels();
/// The paper of a model; findings if there is none.
[[nodiscard]] std::optional<PaperFile> FindPaper(const std::string& model,
                                                 Diagnostics* diagnostics);

/// `options.only`: names of entries; empty: all. Tables are written as .md and .tex.
[[nodiscard]] PaperOutcome MakePaperFigures(const std::string& model, const FigureOptions& options);
/// Of a paper that was loaded.
[[nodiscard]] PaperOutcome MakePaperFigures(const std::string& model, const PaperFile& paper,
                                            const FigureOptions& options);

// What entries of a paper are computed from: runs of scenarios, each once, with other runs' and
// printed numbers as witnesses beside their own.

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

// docs/results/paper_figures.md: all figures of all papers on one page.

/// Markdown. Pictures are named "pictures/paper_MODEL_NAME.png" beside the page.
[[nodiscard]] std::string PaperPage(const std::vector<PaperOutcome>& papers);

}  // namespace mbv
