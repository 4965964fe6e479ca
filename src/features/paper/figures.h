// Figures for papers of a scenario: what it is run for, as files.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "features/convergence/order.h"
#include "features/paper/signals.h"
#include "math/plot.h"
#include "plot/figure.h"
#include "plot/style.h"
#include "report/report.h"
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

// The figures that a paper usually shows of a motion.
//
//   drive_forces, drive_torques   lines of one witness, markers of the others; below, the largest
//                                 difference of all drives, for each pair of witnesses, in
//                                 120 spans of time
//   drive_strokes, drive_angles   positions, and rates below
//   reactions                     magnitudes of joint forces and moments, the largest ones
//   power_energy                  power of each drive; energies
//   force_speed, torque_speed     force over speed
//
// Drives are parted by unit, and where there are more than kMostCurves into several figures.

inline constexpr size_t kMostCurves = 8;  ///< of one panel, each with its own dashes and colour

struct FigureSet {
  std::vector<Figure> figures;
  std::vector<std::string> left_out;  ///< sentences: what is not shown, and why
};
[[nodiscard]] FigureSet DefaultFigures(const Report& report, Language language);

// The figures that a scenario composes, of what its run gave.

/// `specs` passed CheckFigures(). Over time a panel of several signals has a colour and dashes for
/// each, one witness as lines and the others as markers; a panel of one signal, or of differences,
/// or over another signal has a line for each witness. What no witness recorded is left out, and
/// reported.
[[nodiscard]] FigureSet ComposeFigures(const std::vector<FigureSpec>& specs, const Report& report,
                                       Language language);

/// Sections of workspaces (analytic/workspace_form.h): what they say in words, in a language.
[[nodiscard]] Figure FromSection(const std::string& name, const LinePlot& plot, Language language);

// Errors of drive forces against what a simulation is refined by, in logarithmic axes, with lines
// of the slopes that were fitted; the legend names them beside those that the schemes promise.

/// "convergence_step" (step, with the time constant or alone) and "convergence_time_constant";
/// series without two errors above zero are left out, with the reason.
[[nodiscard]] FigureSet ConvergenceFigures(const ConvergenceReport& report, Language language);

}  // namespace mbv
