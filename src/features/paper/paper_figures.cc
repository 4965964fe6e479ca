#include "features/paper/paper_figures.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/markup.h"
#include "base/text.h"
#include "features/paper/figures.h"
#include "features/run/run_scenario.h"
#include "features/stiffness/stiffness_map.h"
#include "features/stiffness/stiffness_report.h"
#include "model_file/load_model.h"
#include "plot/figure.h"
#include "plot/style.h"
#include "report/document.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

constexpr const char* kPaperFile = "paper.yaml";

bool IsOfMaps(PaperMeasure measure) {
  return measure >= PaperMeasure::kMirror && measure <= PaperMeasure::kMedianRatio;
}

class PaperMaker {
 public:
  PaperMaker(const PaperFile& paper, const FigureOptions& options, PaperOutcome* outcome)
      : paper_(paper),
        options_(options),
        outcome_(*outcome),
        runs_(outcome->model, paper, options.programs, options.progress) {}

  void Make(const PaperEntry& entry) {
    PaperResult result;
    result.name = entry.name.text;
    result.title = entry.title;
    result.differs = entry.differs;
    result.note = WithUnitOf(entry);
    for (const PlacedText& row : entry.audit) result.audit.push_back(row.text);
    result.from = entry.section.given() ? "mbverify workspace " + outcome_.model
                                        : "scenario " + outcome_.model + "/" + entry.scenario.text;
    for (const BesideRun& beside : entry.beside) {
      result.from += fmt::format("; {}: {} of {}/{}", beside.name, beside.witness.text,
                                 outcome_.model, beside.scenario.text);
    }
    if (entry.section.given()) {
      MakeSection(entry, &result);
    } else if (!entry.maps.empty()) {
      MakeMaps(entry, &result);
    } else {
      MakeOfRun(entry, &result);
    }
    if (!outcome_.diagnostics.has_errors()) outcome_.results.push_back(std::move(result));
  }

  [[nodiscard]] int exit_code() const { return runs_.exit_code(); }

 private:
  void Error(const PlacedText& at, const std::string& message, const std::string& hint = "") {
    outcome_.diagnostics.Add({.severity = Severity::kError,
                              .file = paper_.file,
                              .line = at.line,
                              .column = at.column,
                              .message = fmt::format("{} = '{}': {}", at.path, at.text, message),
                              .hint = hint});
  }

  void MakeOfRun(const PaperEntry& entry, PaperResult* result) {
    const auto report = runs_.Of(entry, &outcome_.diagnostics);
    if (!report) return;
    for (const PaperStatement& statement : entry.statements) {
      result->said.push_back(
          MeasureSignals(statement, *report, paper_.file, &outcome_.diagnostics));
    }
    if (!entry.columns.empty()) return MakeTable(entry, *report, result);
    FigureSpec spec;
    spec.name = entry.name;
    spec.width_mm = entry.width_mm;
    spec.height_mm = entry.height_mm;
    spec.panels = entry.panels;
    std::vector<Channel> known;
    std::vector<std::string> foreign;
    for (const WitnessRecord& record : report->witnesses) {
      known.insert(known.end(), record.trace.channels.begin(), record.trace.channels.end());
      foreign.push_back(record.name);
    }
    CheckFigures({spec}, known, foreign, paper_.file, &outcome_.diagnostics);
    if (outcome_.diagnostics.has_errors()) return;
    FigureSet set = ComposeFigures({spec}, *report, options_.language);
    for (const std::string& text : set.left_out) Error(entry.name, text);
    if (set.figures.empty()) return;
    AddPrintedLines(entry, &set.figures.front());
    Deliver(std::move(set.figures.front()), result);
  }

  // A line at the number that a statement prints.
  void AddPrintedLines(const PaperEntry& entry, Figure* figure) {
    for (const PaperStatement& statement : entry.statements) {
      if (!statement.panel) continue;
      const size_t k = *statement.panel;
      if (k >= entry.panels.size() || k >= figure->panels.size() ||
          entry.panels[k].unit.text != statement.unit.text) {
        Error(entry.name, fmt::format("'{}': there is no panel {} in '{}', counted from 0",
                                      statement.says, k, statement.unit.text));
        continue;
      }
      double from = kNan, to = kNan;
      for (const FigureCurve& curve : figure->panels[k].curves) {
        for (const auto& [x, y] : curve.points) from = std::fmin(from, x), to = std::fmax(to, x);
      }
      FigureCurve line;
      line.label = "as printed";
      line.points = {{from, statement.printed}, {to, statement.printed}};
      line.look = -1;
      figure->panels[k].curves.push_back(std::move(line));
    }
  }

  void MakeMaps(const PaperEntry& entry, PaperResult* result) {
    const auto prepared =
        PrepareStiffnessFile(runs_.FileOf(entry.scenario), {}, &outcome_.diagnostics);
    if (!prepared) return;
    Figure figure{
        .name = entry.name.text, .width_mm = entry.width_mm, .height_mm = entry.height_mm};
    std::vector<MapPlot> plots;
    for (const PaperMap& wanted : entry.maps) {
      const auto map = ParseMap(wanted.map.text, *prepared, &outcome_.diagnostics);
      if (!map) return;
      const auto made = MapPlots(*map, ComputeMap(*prepared, *map, options_.progress),
                                 prepared->base.name, {wanted.index.text}, &outcome_.diagnostics);
      if (made.empty()) return;
      plots.push_back(made.front().second);
      FigurePanel panel = FromPlot("", plots.back()).panels.front();
      if (!wanted.label.empty()) panel.map->value_label += ", " + wanted.label;
      figure.panels.push_back(std::move(panel));
    }
    for (const PaperStatement& statement : entry.statements) {
      if (!IsOfMaps(statement.measure)) {
        return Error(entry.name, "maps are measured as mirror, mirror_pair or median_ratio");
      }
      result->said.push_back(MeasureMaps(statement, plots, paper_.file, &outcome_.diagnostics));
    }
    Deliver(std::move(figure), result);
  }

  void MakeSection(const PaperEntry& entry, PaperResult* result) {
    const WorkspaceOutcome& workspace = runs_.Workspace(&outcome_.diagnostics);
    if (outcome_.diagnostics.has_errors() || !workspace.summary.ok()) return;
    std::vector<std::string> names;
    const LinePlot* found = nullptr;
    for (const auto& [name, plot] : workspace.plots) {
      names.push_back(name);
      if (name == entry.section.text) found = &plot;
    }
    if (found == nullptr) {
      return Error(entry.section, "the workspace has no such section",
                   DidYouMean(entry.section.text, names, "sections: " + Joined(names)));
    }
    for (const PaperStatement& statement : entry.statements) {
      result->said.push_back(MeasureWorkspace(statement, workspace));
    }
    Figure figure = FromPlot(entry.name.text, *found);
    figure.width_mm = entry.width_mm;
    figure.height_mm = entry.height_mm;
    Deliver(std::move(figure), result);
  }

  StatedResult MeasureWorkspace(const PaperStatement& statement,
                                const WorkspaceOutcome& workspace) {
    StatedResult said;
    said.says = statement.says;
    said.where = statement.where;
    said.printed = statement.printed;
    std::vector<std::string> names;
    for (const WorkspaceMeasure& measure : workspace.measures) {
      names.push_back(measure.name);
      if (measure.name != statement.name.text) continue;
      said.measured = measure.value;
      said.unit = measure.unit;
      return said;
    }
    Error(statement.name, "the workspace has no such measure",
          DidYouMean(statement.name.text, names, "measures: " + Joined(names)));
    return said;
  }

  void MakeTable(const PaperEntry& entry, const Report& report, PaperResult* result) {
    Table table;
    table.name = entry.name.text;
    table.columns = {Digits(entry.head)};
    for (const double at : entry.printed.empty() ? std::vector<double>{} : entry.printed[0].at) {
      table.rows.push_back({fmt::format("{:g}", at)});
    }
    for (const PaperColumn& column : entry.columns) AddColumn(column, entry, report, &table);
    if (outcome_.diagnostics.has_errors()) return;
    result->caption = CaptionOf(*result);
    table.caption = entry.title + (result->caption.empty() ? "" : ". " + result->caption);
    Table bare = table;
    bare.caption.clear();
    result->table = ToMarkdown(bare);
    AddFile(result, entry.name.text + ".md", ToMarkdown(table));
    AddFile(result, entry.name.text + ".tex", ToLatex(table));
  }

  void AddColumn(const PaperColumn& column, const PaperEntry& entry, const Report& report,
                 Table* table) {
    const Trace* trace = TraceOf(report, column.of.text);
    if (trace == nullptr) return Error(column.of, "no such witness ran");
    const int at = trace->Find(column.signal.text);
    if (at < 0) return Error(column.signal, "not recorded by " + column.of.text);
    const std::string& si = trace->channels[static_cast<size_t>(at)].unit;
    const ShownUnit* unit = FindUnit(si, column.unit.text);
    if (unit == nullptr) return Error(column.unit, "no unit of what is recorded in " + si);
    const bool one_unit = !CommonUnit(entry).empty();
    table->columns.push_back(
        Digits(one_unit ? column.title : fmt::format("{} ({})", column.title, column.unit.text)));
    for (size_t row = 0; row < table->rows.size(); ++row) {
      const double wanted = entry.printed[0].at[row];
      std::string cell;
      for (size_t i = 0; i < trace->time_s.size(); ++i) {
        if (trace->time_s[i] != wanted) continue;
        cell =
            fmt::format("{:.{}f}", unit->factor * trace->values(static_cast<Eigen::Index>(i), at),
                        column.digits);
      }
      table->rows[row].push_back(std::move(cell));
    }
  }

  // Of all columns of a table; "" if there is none.
  static std::string CommonUnit(const PaperEntry& entry) {
    for (const PaperColumn& column : entry.columns) {
      if (column.unit.text != entry.columns.front().unit.text) return "";
    }
    return entry.columns.empty() ? "" : entry.columns.front().unit.text;
  }

  static std::string WithUnitOf(const PaperEntry& entry) {
    const std::string unit = CommonUnit(entry);
    if (unit.empty()) return entry.caption;
    return "All in " + unit + "." + (entry.caption.empty() ? "" : " ") + entry.caption;
  }

  // The entry's own words, then what the paper says and by how much it is off.
  static std::string CaptionOf(const PaperResult& result) {
    std::string caption = result.note;
    for (const StatedResult& said : result.said) {
      caption += (caption.empty() ? "" : " ") + ResultText(said) + ".";
    }
    return caption;
  }

  void Deliver(Figure figure, PaperResult* result) {
    if (outcome_.diagnostics.has_errors()) return;
    figure.caption = result->caption = CaptionOf(*result);
    for (auto& [name, content] : DrawnFiles(figure, options_, &outcome_.diagnostics)) {
      AddFile(result, name, std::move(content));
    }
  }

  void AddFile(PaperResult* result, const std::string& name, std::string content) {
    result->files.push_back(name);
    outcome_.files.emplace_back(name, std::move(content));
  }

  const PaperFile& paper_;
  const FigureOptions& options_;
  PaperOutcome& outcome_;
  PaperRuns runs_;
};

// Entries by name; unknown ones are findings, and those that are not computed are reported.
std::vector<const PaperEntry*> WantedOf(const PaperFile& paper,
                                        const std::vector<std::string>& only,
                                        PaperOutcome* outcome) {
  std::vector<const PaperEntry*> wanted;
  std::vector<std::string> names;
  for (const PaperEntry& entry : paper.entries) {
    names.push_back(entry.name.text);
    if (only.empty() || Contains(only, entry.name.text)) wanted.push_back(&entry);
  }
  for (const auto& [name, why] : paper.left_out) {
    names.push_back(name);
    if (only.empty() || Contains(only, name)) outcome->left_out.emplace_back(name, why);
  }
  for (const std::string& name : only) {
    if (Contains(names, name)) continue;
    outcome->diagnostics.AddError("--paper " + outcome->model,
                                  Printable(name) + ": there is no such figure",
                                  DidYouMean(name, names, "figures: " + Joined(names)));
  }
  return wanted;
}

}  // namespace

std::vector<std::string> PaperModels() {
  std::vector<std::string> models;
  for (const std::string& name : ModelNames(std::filesystem::current_path())) {
    const auto model = FindModel(name, std::filesystem::current_path());
    if (model &&
        std::filesystem::exists(std::filesystem::path(*model).parent_path() / kPaperFile)) {
      models.push_back(name);
    }
  }
  return models;
}

std::optional<PaperFile> FindPaper(const std::string& model, Diagnostics* diagnostics) {
  const std::vector<std::string> known = PaperModels();
  if (!Contains(known, model)) {
    diagnostics->AddError("--paper " + Printable(model), "there is no paper of such a model",
                          DidYouMean(model, known, "papers: " + Joined(known)));
    return {};
  }
  const auto file = FindModel(model, std::filesystem::current_path());
  return LoadPaper(Shown(std::filesystem::path(*file).parent_path() / kPaperFile), diagnostics);
}

PaperOutcome MakePaperFigures(const std::string& model, const FigureOptions& options) {
  Diagnostics diagnostics;
  const auto paper = FindPaper(model, &diagnostics);
  if (paper) return MakePaperFigures(model, *paper, options);
  PaperOutcome outcome;
  outcome.model = model;
  outcome.exit_code = 2;
  outcome.diagnostics = std::move(diagnostics);
  return outcome;
}

PaperOutcome MakePaperFigures(const std::string& model, const PaperFile& paper,
                              const FigureOptions& options) {
  PaperOutcome outcome;
  outcome.model = model;
  outcome.exit_code = 2;
  outcome.source = paper.source;
  const auto wanted = WantedOf(paper, options.only, &outcome);
  if (outcome.diagnostics.has_errors()) return outcome;
  PaperMaker maker(paper, options, &outcome);
  for (const PaperEntry* entry : wanted) maker.Make(*entry);
  outcome.exit_code = outcome.diagnostics.has_errors() ? 2 : maker.exit_code();
  if (outcome.exit_code == 2) outcome.files.clear();
  return outcome;
}

namespace {

constexpr const char* kLoadChannel = "load";

Channel LoadNumber() { return {.name = kLoadChannel, .unit = "1", .frame = ""}; }

// The displacements of one witness, a row for each load.
Trace TraceOfLoads(const StiffnessWitness& witness) {
  Trace trace;
  trace.witness = witness.name;
  std::vector<double> numbers;
  for (size_t k = 0; k < witness.displacements.size(); ++k) {
    numbers.push_back(static_cast<double>(k + 1));
  }
  std::vector<Channel> channels = {LoadNumber()};
  for (int i = 0; i < 6; ++i) {
    channels.push_back({.name = fmt::format("{}.{}", i < 3 ? "rotation" : "displacement",
                                            kPoseComponents[static_cast<size_t>(i % 3)]),
                        .unit = i < 3 ? "rad" : "m",
                        .frame = "world"});
  }
  trace.Reset(std::move(numbers), std::move(channels));
  for (size_t k = 0; k < witness.displacements.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    trace.values(row, 0) = static_cast<double>(k + 1);
    trace.values.row(row).tail(6) = witness.displacements[k].transpose();
  }
  return trace;
}

Report ReportOfLoads(const StiffnessReport& stiffness) {
  Report report;
  static_cast<ResultFrame&>(report) = stiffness;
  for (const StiffnessWitness& witness : stiffness.witnesses) {
    if (witness.displacements.empty()) continue;
    report.witnesses.push_back({witness.name, RunSummary::Done(), TraceOfLoads(witness)});
  }
  report.duration_s = static_cast<double>(stiffness.loads.size());
  report.comparison.verdict = stiffness.comparison.verdict;
  return report;
}

const Channel* FindChannel(const Report& report, const std::string& name) {
  for (const WitnessRecord& record : report.witnesses) {
    const int column = record.trace.Find(name);
    if (column >= 0) return &record.trace.channels[static_cast<size_t>(column)];
  }
  return nullptr;
}

std::vector<std::string> ChannelNamesOf(const Report& report) {
  std::vector<std::string> names;
  for (const WitnessRecord& record : report.witnesses) {
    for (const Channel& channel : record.trace.channels) names.push_back(channel.name);
  }
  return names;
}

}  // namespace

void PaperRuns::Error(const PlacedText& at, const std::string& message, const std::string& hint,
                      Diagnostics* diagnostics) const {
  diagnostics->Add({.severity = Severity::kError,
                    .file = paper_.file,
                    .line = at.line,
                    .column = at.column,
                    .message = fmt::format("{} = '{}': {}", at.path, at.text, message),
                    .hint = hint});
}

std::string PaperRuns::FileOf(const PlacedText& scenario) const {
  return FindScenario(model_ + "/" + scenario.text);
}

const Report* PaperRuns::Run(const PlacedText& scenario, Diagnostics* diagnostics) {
  const std::string file = FileOf(scenario);
  if (!std::filesystem::exists(file)) {
    Error(scenario, "there is no scenario " + file, "", diagnostics);
    return nullptr;
  }
  auto [at, added] = runs_.try_emplace(file);
  if (!added) return at->second ? &*at->second : nullptr;
  RunOptions options;
  options.pictures = options.page = false;
  options.programs = programs_;
  options.progress = progress_;
  RunOutcome ran = RunScenario(file, options);
  exit_code_ = std::max(exit_code_, ran.exit_code);
  diagnostics->Append(ran.diagnostics);
  if (ran.report) at->second = std::move(*ran.report);
  if (const auto* stiffness = dynamic_cast<const ShownStiffness*>(ran.other.get())) {
    at->second = ReportOfLoads(stiffness->report());
  }
  return at->second ? &*at->second : nullptr;
}

void PaperRuns::AddBeside(const BesideRun& beside, Report* report, Diagnostics* diagnostics) {
  const Report* other = Run(beside.scenario, diagnostics);
  if (other == nullptr) return;
  const Trace* trace = TraceOf(*other, beside.witness.text);
  if (trace == nullptr || trace->time_s.empty()) {
    return Error(beside.witness, "no such witness ran in " + beside.scenario.text, "", diagnostics);
  }
  report->witnesses.push_back({beside.name, RunSummary::Done(), *trace, Witness::Foreign{}});
}

void PaperRuns::AddPrinted(const PrintedNumbers& numbers, Report* report,
                           Diagnostics* diagnostics) {
  Trace trace;
  trace.witness = numbers.name;
  std::vector<Channel> channels;
  std::vector<double> factors;
  for (const auto& [signal, values] : numbers.signals) {
    const Channel* known = FindChannel(*report, signal.text);
    if (known == nullptr) {
      return Error(signal, "no witness records such a signal",
                   DidYouMean(signal.text, ChannelNamesOf(*report), ""), diagnostics);
    }
    const ShownUnit* unit = FindUnit(known->unit, numbers.unit.text);
    if (unit == nullptr && numbers.unit.text != known->unit) {
      return Error(numbers.unit, "no unit of what is recorded in " + known->unit, "", diagnostics);
    }
    channels.push_back(*known);
    factors.push_back(unit != nullptr ? unit->factor : 1.0);
  }
  const bool loads = FindChannel(*report, kLoadChannel) != nullptr;
  if (loads) channels.push_back(LoadNumber());
  trace.Reset(numbers.at, channels);
  for (size_t i = 0; i < numbers.at.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (size_t k = 0; k < factors.size(); ++k) {
      trace.values(row, static_cast<Eigen::Index>(k)) = numbers.signals[k].second[i] / factors[k];
    }
    if (loads) trace.values(row, static_cast<Eigen::Index>(factors.size())) = numbers.at[i];
  }
  report->witnesses.push_back(
      {numbers.name, RunSummary::Done(), std::move(trace), Witness::Foreign{}});
}

std::optional<Report> PaperRuns::Of(const PaperEntry& entry, Diagnostics* diagnostics) {
  const Report* run = Run(entry.scenario, diagnostics);
  if (run == nullptr) return {};
  Report report = *run;
  for (const BesideRun& beside : entry.beside) AddBeside(beside, &report, diagnostics);
  for (const PrintedNumbers& numbers : entry.printed) AddPrinted(numbers, &report, diagnostics);
  if (diagnostics->has_errors()) return {};
  return report;
}

const WorkspaceOutcome& PaperRuns::Workspace(Diagnostics* diagnostics) {
  if (workspace_) return *workspace_;
  workspace_.emplace();
  const auto model = FindModel(model_, std::filesystem::current_path());
  LoadResult loaded;
  if (model) loaded = LoadModel(*model);
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.mechanism) return *workspace_;
  workspace_ = ComputeWorkspace(*loaded.mechanism, false);
  diagnostics->Append(workspace_->diagnostics);
  if (!workspace_->summary.ok()) exit_code_ = std::max(exit_code_, 3);
  if (!workspace_->agree) exit_code_ = std::max(exit_code_, 1);
  return *workspace_;
}

namespace {

constexpr const char* kHead =
    R"(# The papers' figures, computed anew

Written by `scripts/results paper_figures`; do not edit. `mbverify figures --paper MODEL` draws them
(`docs/how-to/figures.md`); `models/MODEL/paper.yaml` states what they show.

“…” quotes, shortened and in English, what a paper states about a figure. Its place, the printed
number and the computed value follow. The project has the text of the papers, but not their
pictures: a curve that is only drawn there is not compared. Where no "printed" number follows, the
paper gives none.
)";

std::string AuditText(const PaperResult& result) {
  if (result.audit.empty()) return "";
  std::string text;
  for (const std::string& row : result.audit)
    text += (text.empty() ? "" : ", ") + MarkdownCode(row);
  return " Equation audit (`docs/results/equation_audit.md`): " + text + ".";
}

std::string EntryText(const PaperOutcome& paper, const PaperResult& result) {
  std::string text = fmt::format("### {}: {}\n\n", result.name, MarkdownText(result.title));
  if (result.table.empty()) {
    text += fmt::format("![{}](../pictures/paper_{}_{}.png)\n\n", MarkdownText(result.title),
                        paper.model, result.name);
  } else {
    text += result.table + "\n";
  }
  text += fmt::format("Computed from {}.{}{}\n", result.from, result.note.empty() ? "" : " ",
                      result.note);
  for (const StatedResult& said : result.said) text += "\n* " + ResultText(said);
  if (!result.said.empty()) text += "\n";
  if (!result.differs.empty()) {
    text += "\nThe printed one differs: " + result.differs + AuditText(result) + "\n";
  } else if (!result.audit.empty()) {
    text += "\n" + AuditText(result).substr(1) + "\n";
  }
  return text;
}

}  // namespace

std::string PaperPage(const std::vector<PaperOutcome>& papers) {
  std::string text = kHead;
  for (const PaperOutcome& paper : papers) {
    text += fmt::format("\n## {}\n\n{}\n", paper.model, paper.source);
    for (const PaperResult& result : paper.results) text += "\n" + EntryText(paper, result);
    if (paper.left_out.empty()) continue;
    text += "\n### Not computed\n\n";
    for (const auto& [name, why] : paper.left_out) text += fmt::format("* {}: {}\n", name, why);
  }
  return ForTerminal(text);  // sentences of paper.yaml are Markdown, without marks that mislead
}

}  // namespace mbv
