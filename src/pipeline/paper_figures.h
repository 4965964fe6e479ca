// The figures and tables of a paper (models/NAME/paper.yaml), computed anew.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "figure/paper_statements.h"
#include "pipeline/figures.h"
#include "scenario/paper_file.h"

namespace mbv {

/// An entry as it came out.
struct PaperResult {
  std::string name, title;
  std::string from;     ///< what it is computed from: "scenario stabilizing_platform/sea_state"
  std::string note;     ///< its own words
  std::string caption;  ///< the note with what the paper says and by how much that is off
  std::string differs;  ///< why the printed one does
  std::vector<std::string> audit;  ///< rows of the equation audit
  std::vector<SaidResult> said;
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

}  // namespace mbv
