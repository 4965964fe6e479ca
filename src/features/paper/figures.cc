#include "features/paper/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "base/scratch_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "features/convergence/converge.h"
#include "features/paper/compose.h"
#include "features/paper/default_figures.h"
#include "features/paper/from_plot.h"
#include "features/run/run_scenario.h"
#include "features/stiffness/stiffness_map.h"
#include "features/study/study.h"
#include "features/study/study_html.h"
#include "features/workspace/workspace.h"
#include "plot/draw.h"
#include "plot/pgf.h"
#include "verify/check_file.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

struct FigureFormatRow {
  const char* word;
  PictureFormat format;
};
constexpr std::array<FigureFormatRow, 3> kFigureFormats = {
    {{"pdf", PictureFormat::kPdf}, {"svg", PictureFormat::kSvg}, {"png", PictureFormat::kPng}}};

constexpr const char* kPgf = "pgf";

// Figures of a scenario before they are drawn.
class FigureSource {
 public:
  FigureSource(const std::string& file, const FigureOptions& options, FigureOutcome* outcome)
      : file_(file), options_(options), outcome_(outcome) {}

  FigureSet OfMotion() {
    RunOptions run;
    run.scenario = options_.scenario;
    run.programs = options_.programs;
    run.pictures = run.page = false;
    run.progress = options_.progress;
    return OfMotion(RunScenario(file_, run));
  }

  FigureSet OfMotion(const RunOutcome& ran) {
    outcome_->exit_code = ran.exit_code;
    outcome_->diagnostics = ran.diagnostics;
    if (!ran.report) return {};
    outcome_->mechanism = ran.report->mechanism;
    outcome_->scenario = ran.report->scenario;
    outcome_->verdict = ToText(ran.report->comparison.verdict);
    return WithUsual(ComposeFigures(ran.figures, *ran.report, options_.language), *ran.report);
  }

  // The plots of its page that are lines; its points are computed for them.
  FigureSet OfStudy() {
    FigureSet set;
    outcome_->exit_code = 2;
    if (!options_.scenario.set.empty()) {
      outcome_->diagnostics.AddError(file_, "--set sets keys of scenarios, and this is a study",
                                     "its own keys say what is varied");
      return set;
    }
    const ScratchFolder scratch("study");
    if (!scratch.trouble().empty()) {
      outcome_->diagnostics.AddError("", scratch.trouble(), "");
      return set;
    }
    RunStudyOptions run;
    run.out_dir = scratch.path().string();
    run.points.jobs = AllCores();
    run.points.progress = [&](std::uint64_t done, std::uint64_t all) {
      if (options_.progress) {
        options_.progress("points", static_cast<double>(done) / static_cast<double>(all));
      }
    };
    const StudyOutcome ran = RunStudy(file_, run);
    outcome_->exit_code = ran.exit_code;
    outcome_->diagnostics = ran.diagnostics;
    if (!ran.report) return set;
    outcome_->mechanism = "studies";
    outcome_->scenario = ran.report->study.name;
    for (const StudyPlot& plot : StudyPlots(*ran.report)) {
      const std::string name = std::filesystem::path(plot.file).stem();
      if (plot.lines) {
        set.figures.push_back(FromPlot(name, *plot.lines));
      } else {
        set.left_out.push_back(name + ": mbverify study draws it");
      }
    }
    return set;
  }

  FigureSet OfStiffness() {
    FigureSet set;
    outcome_->exit_code = 2;
    const auto prepared = PrepareStiffnessFile(file_, options_.scenario, &outcome_->diagnostics);
    if (!prepared) return set;
    outcome_->exit_code = 0;
    outcome_->mechanism = prepared->base.name;
    outcome_->scenario = prepared->scenario.name;
    const std::vector<std::string> maps = UsualMaps(prepared->base.name);
    if (maps.empty()) {
      set.left_out.push_back(prepared->base.name +
                             " has no usual maps; mbverify stiffness --map draws any");
    }
    for (const std::string& text : maps) AddMap(*prepared, text, &set);
    return set;
  }

 private:
  // The scenario's own figures, then the usual ones; of two of one name the own one.
  FigureSet WithUsual(FigureSet set, const Report& report) const {
    FigureSet usual = DefaultFigures(report, options_.language);
    const size_t own = set.figures.size();
    for (Figure& figure : usual.figures) {
      const bool replaced = std::any_of(set.figures.begin(), set.figures.begin() + own,
                                        [&](const Figure& f) { return f.name == figure.name; });
      if (!replaced) set.figures.push_back(std::move(figure));
    }
    set.left_out.insert(set.left_out.end(), usual.left_out.begin(), usual.left_out.end());
    return set;
  }

  void AddMap(const PreparedStiffness& prepared, const std::string& text, FigureSet* set) {
    const auto map = ParseMap(text, prepared, &outcome_->diagnostics);
    if (!map) return;
    const MapResult result = ComputeMap(prepared, *map, options_.progress);
    for (const auto& [name, plot] :
         MapPlots(*map, result, prepared.base.name, {}, &outcome_->diagnostics)) {
      set->figures.push_back(FromPlot("map_" + name, plot));
    }
  }

  const std::string& file_;
  const FigureOptions& options_;
  FigureOutcome* outcome_;
};

// What is drawn only on request.
class MoreFigureSource {
 public:
  MoreFigureSource(const std::string& file, const FigureOptions& options, FigureOutcome* outcome,
                   FigureSet* set)
      : file_(file), options_(options), outcome_(outcome), set_(set) {}

  void AddConvergence() {
    if (const DocumentKind& kind = KindOf(file_); kind.timeless()) {
      return LeaveOut(fmt::format("convergence: a {} has no steps", kind.name));
    }
    ConvergeOptions converge;
    converge.scenario = options_.scenario;
    converge.progress = options_.progress;
    const ConvergeOutcome refined = Converge(file_, converge);
    if (refined.exit_code == 3) return LeaveOut("convergence: " + refined.failure);
    if (refined.exit_code > 1) return outcome_->diagnostics.Append(refined.diagnostics);
    if (outcome_->exit_code == 0) outcome_->exit_code = refined.exit_code;
    FigureSet drawn = ConvergenceFigures(refined.report, options_.language);
    for (Figure& figure : drawn.figures) set_->figures.push_back(std::move(figure));
    for (const std::string& text : drawn.left_out) LeaveOut(text);
  }

  void AddWorkspace() {
    if (const DocumentKind& kind = KindOf(file_); kind.timeless()) {
      return LeaveOut("workspace: is drawn with a motion of the mechanism");
    }
    Diagnostics run_findings;
    const auto prepared = Prepare(file_, options_.scenario, &run_findings);
    if (!prepared) return;
    const WorkspaceOutcome reached = ComputeWorkspace(prepared->base, false);
    if (reached.diagnostics.has_errors()) {
      return LeaveOut("workspace: " + reached.diagnostics.findings().front().message);
    }
    outcome_->diagnostics.Append(reached.diagnostics);
    if (!reached.summary.ok()) return LeaveOut("workspace: " + reached.summary.message);
    if (!reached.agree && outcome_->exit_code == 0) outcome_->exit_code = 1;
    for (const auto& [name, plot] : reached.plots) {
      set_->figures.push_back(FromSection(NameOf(name), plot, options_.language));
    }
    for (const auto& [name, plot] : reached.maps) {
      set_->figures.push_back(FromPlot(NameOf(name), plot));
    }
  }

 private:
  // "sections.svg" → "workspace_sections".
  static std::string NameOf(const std::string& file) {
    const std::string stem = std::filesystem::path(file).stem();
    return stem.starts_with("workspace") ? stem : "workspace_" + stem;
  }
  void LeaveOut(const std::string& text) { set_->left_out.push_back(text); }

  const std::string& file_;
  const FigureOptions& options_;
  FigureOutcome* outcome_;
  FigureSet* set_;
};

// Those that are wanted; a name that is not one of them is bad input.
void KeepOnly(const std::vector<std::string>& only, FigureSet* set, FigureOutcome* outcome) {
  std::vector<std::string> names;
  for (const Figure& figure : set->figures) names.push_back(figure.name);
  for (const std::string& name : only) {
    if (Contains(names, name)) continue;
    outcome->diagnostics.AddError(
        "--only " + Printable(name), "there is no such figure",
        DidYouMean(name, names, names.empty() ? "" : "figures: " + Joined(names)));
    outcome->exit_code = 2;
  }
  if (only.empty()) return;
  std::erase_if(set->figures, [&](const Figure& figure) { return !Contains(only, figure.name); });
}

}  // namespace

const std::vector<std::string>& FigureFormats() {
  static const std::vector<std::string> words = {"pdf", "svg", "png", kPgf};
  return words;
}

const std::vector<std::string>& MoreFigures() {
  static const std::vector<std::string> words = {"convergence", "workspace"};
  return words;
}

std::vector<std::pair<std::string, std::string>> DrawnFiles(const Figure& figure,
                                                            const FigureOptions& options,
                                                            Diagnostics* diagnostics) {
  if (LacksGlyphs(figure, options.style)) {
    Finding finding;
    finding.severity = Severity::kWarning;
    finding.message = fmt::format("{}: no font here has all its characters", figure.name);
    finding.hint = "for Chinese install the Debian package fonts-noto-cjk";
    diagnostics->Add(std::move(finding));
  }
  std::vector<std::pair<std::string, std::string>> files;
  for (const FigureFormatRow& row : kFigureFormats) {
    if (!Contains(options.formats, row.word)) continue;
    files.emplace_back(figure.name + "." + row.word, DrawFigure(figure, options.style, row.format));
  }
  if (Contains(options.formats, kPgf)) {
    for (auto& file : PgfFiles(figure, options.style)) files.push_back(std::move(file));
  }
  return files;
}

FigureOutcome MakeFigures(const std::string& file, const FigureOptions& options,
                          const RunOutcome* ran) {
  FigureOutcome outcome;
  FigureSource source(file, options, &outcome);
  const std::string_view kind = KindOf(file).name;
  FigureSet set = kind == "study"       ? source.OfStudy()
                  : kind == "stiffness" ? source.OfStiffness()
                  : ran != nullptr      ? source.OfMotion(*ran)
                                        : source.OfMotion();
  if (outcome.diagnostics.has_errors()) return outcome;
  MoreFigureSource more(file, options, &outcome, &set);
  if (Contains(options.also, "convergence")) more.AddConvergence();
  if (Contains(options.also, "workspace")) more.AddWorkspace();
  if (outcome.diagnostics.has_errors()) outcome.exit_code = 2;
  if (outcome.diagnostics.has_errors()) return outcome;
  KeepOnly(options.only, &set, &outcome);
  if (outcome.diagnostics.has_errors()) return outcome;
  for (const Figure& figure : set.figures) {
    MadeFigure made{figure, {}};
    for (auto& file : DrawnFiles(figure, options, &outcome.diagnostics)) {
      made.files.push_back(file.first);
      outcome.files.push_back(std::move(file));
    }
    outcome.figures.push_back(std::move(made));
  }
  outcome.left_out = std::move(set.left_out);
  return outcome;
}

}  // namespace mbv
