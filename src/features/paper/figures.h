// Figures for papers of a scenario: what it is run for, as files.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "features/paper/signals.h"
#include "plot/figure.h"
#include "plot/style.h"
#include "verify/run_options.h"

namespace mbv {

struct FigureOptions {
  ScenarioOptions scenario;
  ProgramConsent programs = {};  ///< that scenarios name
  FigureStyle style = FigureStyles().front();
  Language language = Language::kEnglish;
  std::vector<std::string> formats = {"pdf"};  ///< words of FigureFormats()
  std::vector<std::string> only;               ///< names of figures; empty: all
  std::vector<std::string> also;               ///< words of MoreFigures(): drawn in addition
  ProgressFunction progress;
};

/// "pdf", "svg", "png", "pgf" (source for TeX with its data).
[[nodiscard]] const std::vector<std::string>& FigureFormats();

/// "convergence" (errors against the step: runs the motion several times), "workspace" (sections).
[[nodiscard]] const std::vector<std::string>& MoreFigures();

/// A figure and the names of its files.
struct MadeFigure {
  Figure figure;
  std::vector<std::string> files;
};

struct FigureOutcome {
  int exit_code = 4;  ///< of the run: a disagreement is drawn, too
  Diagnostics diagnostics;
  std::string mechanism, scenario, verdict;  ///< verdict: of a motion; else ""
  std::vector<MadeFigure> figures;
  std::vector<std::string> left_out;                       ///< sentences
  std::vector<std::pair<std::string, std::string>> files;  ///< name, content
};

/// The files (name, content) of a figure in all formats that are wanted; characters that no font
/// here has are a warning.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> DrawnFiles(
    const Figure& figure, const FigureOptions& options, Diagnostics* diagnostics);

/// Runs a motion (RunScenario()) and draws the figures that its scenario composes, and the usual
/// ones; of a stiffness, its mechanism's usual maps; of a study, its plots. Findings are bad input.
/// `ran`: the result of a run with these options; null: it is run.
[[nodiscard]] FigureOutcome MakeFigures(const std::string& file, const FigureOptions& options,
                                        const RunOutcome* ran = nullptr);

}  // namespace mbv
