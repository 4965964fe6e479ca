#include "features/paper/figures.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/scratch_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "comparison/force_band.h"
#include "features/convergence/converge.h"
#include "features/paper/signals.h"
#include "features/run/run_scenario.h"
#include "features/stiffness/stiffness_map.h"
#include "features/study/study.h"
#include "features/study/study_report.h"
#include "features/workspace/workspace.h"
#include "plot/draw.h"
#include "plot/figure.h"
#include "plot/layout.h"
#include "verify/check_file.h"
#include "verify/prepare.h"

namespace mbv {

namespace {

// The words that a label begins with, in a language.
void Translate(const std::string& words, FigureWord word, Language language, std::string* label) {
  if (label->starts_with(words)) label->replace(0, words.size(), WordFor(word, language));
}

}  // namespace

Figure FromSection(const std::string& name, const LinePlot& plot, Language language) {
  Figure figure = FromPlot(name, plot);
  FigurePanel& panel = figure.panels.front();
  for (FigureAxis* axis : {&panel.x, &panel.y}) {
    Translate("distance from the axis", FigureWord::kAxisDistance, language, &axis->label);
  }
  for (FigureCurve& curve : panel.curves) {
    Translate("azimuth", FigureWord::kAzimuth, language, &curve.label);
    if (curve.label.ends_with(" deg")) curve.label.replace(curve.label.size() - 4, 4, "°");
  }
  return figure;
}

namespace {

class ConvergenceFigureMaker {
 public:
  ConvergenceFigureMaker(const ConvergenceReport& report, Language language)
      : report_(report), language_(language) {}

  FigureSet Make() {
    Add("convergence_step", FigureWord::kStep, "*h*", false);
    Add("convergence_time_constant", FigureWord::kTimeConstant, "*t*_{c}", true);
    return std::move(set_);
  }

 private:
  [[nodiscard]] std::string In(FigureWord word) const { return WordFor(word, language_); }

  void Add(const std::string& name, FigureWord against, const char* symbol, bool time_constant) {
    FigurePanel panel{.x = {AxisLabel(In(against), symbol, "s"), true},
                      .y = {AxisLabel(In(FigureWord::kForceError), "", ""), true}};
    for (const ConvergenceSeries& series : report_.series) {
      if ((series.knob == Knob::kTimeConstant) == time_constant) AddSeries(series, &panel);
    }
    if (panel.curves.empty()) {
      set_.left_out.push_back(name + ": no series has two errors to show");
      return;
    }
    set_.figures.push_back(
        {.name = name,
         .caption =
             fmt::format("Error of the drive forces of {} / {} against {}", report_.mechanism,
                         report_.scenario, WordFor(against, Language::kEnglish)),
         .panels = {std::move(panel)}});
  }

  // Markers at the errors, and through those that were fitted a line of the fitted slope.
  void AddSeries(const ConvergenceSeries& series, FigurePanel* panel) {
    const std::vector<double> errors = JudgedErrors(series);
    FigurePoints points;
    for (size_t i = 0; i < errors.size(); ++i) {
      if (errors[i] > 0.0) points.emplace_back(KnobOf(series, series.points[i]), errors[i]);
    }
    if (points.size() < 2) {
      set_.left_out.push_back(series.name + ": fewer than two errors above zero");
      return;
    }
    const int look = series_++;
    panel->curves.push_back({.label = LabelOf(series),
                             .points = points,
                             .look = look,
                             .line = false,
                             .marker = look % kMarkerShapes});
    if (series.fit.first_fitted() < 0) return;
    panel->curves.push_back(
        {.label = "", .points = Slope(series, errors, series.fit.order), .look = look});
    panel->curves.back().extent = true;
  }

  [[nodiscard]] std::string LabelOf(const ConvergenceSeries& series) const {
    std::string label = In(series.stock ? FigureWord::kStockEngine : FigureWord::kCorrectedEngine);
    if (series.knob == Knob::kStep) label += ", " + In(FigureWord::kStepAlone);
    if (series.fit.first_fitted() < 0) return label;
    return label + fmt::format(", *p* = {:.2f} ({})", series.fit.order, ToText(series.expected));
  }

  // C x^order over the fitted points, through their logarithmic mean.
  static FigurePoints Slope(const ConvergenceSeries& series, const std::vector<double>& errors,
                            double order) {
    double log_x = 0.0, log_error = 0.0, count = 0.0;
    for (size_t i = 0; i < errors.size(); ++i) {
      if (!series.fit.fitted[i]) continue;
      log_x += std::log(KnobOf(series, series.points[i]));
      log_error += std::log(errors[i]);
      count += 1.0;
    }
    FigurePoints line;
    for (const int end : {series.fit.first_fitted(), series.fit.last_fitted()}) {
      const double x = KnobOf(series, series.points[static_cast<size_t>(end)]);
      line.emplace_back(x, std::exp(log_error / count + order * (std::log(x) - log_x / count)));
    }
    return line;
  }

  const ConvergenceReport& report_;
  const Language language_;
  int series_ = 0;
  FigureSet set_;
};

}  // namespace

FigureSet ConvergenceFigures(const ConvergenceReport& report, Language language) {
  return ConvergenceFigureMaker(report, language).Make();
}

namespace {

constexpr size_t kMostMarks = 60;  // of one curve; more would be a band

class PanelComposer {
 public:
  PanelComposer(const PanelSpec& spec, const Report& report, Language language)
      : spec_(spec), report_(report), language_(language) {
    for (const WitnessRecord* record : ShownWitnesses(report)) {
      const auto named = [&](const PlacedText& text) { return text.text == record->name; };
      const bool wanted = spec.witnesses.empty() || std::ranges::any_of(spec.witnesses, named);
      if (wanted && record->name != spec.against.text) witnesses_.push_back(record);
    }
    FindChannels();
  }

  // What was not recorded.
  [[nodiscard]] const std::vector<std::string>& missing() const { return missing_; }

  [[nodiscard]] bool empty() const { return channels_.empty(); }

  FigurePanel Compose() {
    panel_.share = spec_.share;
    panel_.y.log = spec_.log;
    panel_.equal_scale = spec_.equal_scale;
    ChooseUnits();
    if (spec_.against.given()) {
      Differences();
    } else if (spec_.x.given() || channels_.size() == 1) {
      LinePerWitness();
    } else {
      AddOverTime(Rows(), witnesses_, LineOf(),
                  {x_unit_, unit_, language_, spec_.legend, spec_.from_start}, &panel_);
    }
    if (!spec_.legend) {
      for (FigureCurve& curve : panel_.curves) curve.label.clear();
    }
    NameAxes();
    return std::move(panel_);
  }

 private:
  // In the order of the patterns, then of the traces; each once.
  void FindChannels() {
    for (const PlacedText& signal : spec_.signals) {
      const size_t before = channels_.size();
      for (const WitnessRecord* record : witnesses_) {
        for (const Channel& channel : record->trace.channels) {
          if (!FitsPattern(channel.name, signal.text) || Contains(channels_, channel.name))
            continue;
          channels_.push_back(channel.name);
          si_ = channel.unit;
        }
      }
      if (channels_.size() == before) missing_.push_back(signal.path + " = '" + signal.text + "'");
    }
  }

  void ChooseUnits() {
    double largest = 0, x_largest = report_.duration_s;
    for (const std::string& channel : channels_) {
      largest = std::max(largest, LargestOf(report_, channel));
    }
    if (spec_.against.given()) largest = 1.0;
    std::string x_si = "s";
    if (spec_.x.given()) {
      for (const WitnessRecord* record : witnesses_) {
        const int column = record->trace.Find(spec_.x.text);
        if (column >= 0) x_si = record->trace.channels[static_cast<size_t>(column)].unit;
      }
      x_largest = LargestOf(report_, spec_.x.text);
    }
    unit_ = Chosen(spec_.unit, si_, largest);
    x_unit_ = Chosen(spec_.x_unit, x_si, x_largest);
  }

  static ShownUnit Chosen(const PlacedText& wanted, const std::string& si, double largest) {
    const ShownUnit* unit = wanted.given() ? FindUnit(si, wanted.text) : nullptr;
    return unit != nullptr ? *unit : UsualUnit(si, largest);
  }

  [[nodiscard]] const WitnessRecord* LineOf() const {
    const WitnessRecord* line = LineWitness(report_);
    const bool shown = std::ranges::find(witnesses_, line) != witnesses_.end();
    return shown ? line : witnesses_.empty() ? nullptr : witnesses_.front();
  }

  [[nodiscard]] std::string NameOf(const std::string& channel) const {
    const auto found = spec_.names.find(channel);
    return found != spec_.names.end() ? found->second : AsPlainText(channel);
  }

  [[nodiscard]] std::vector<SignalRow> Rows() const {
    std::vector<SignalRow> rows;
    for (const std::string& channel : channels_) rows.push_back({channel, NameOf(channel)});
    return rows;
  }

  // "name", "witness", or both where there are several of both.
  [[nodiscard]] std::string RowName(const std::string& channel, const std::string& witness) const {
    if (channels_.size() == 1 && !spec_.names.contains(channel)) return witness;
    if (witnesses_.size() == 1) return NameOf(channel);
    return NameOf(channel) + ", " + witness;
  }

  void AddCurve(const std::string& label, const FigurePoints& points) {
    panel_.curves.push_back(
        {.label = label, .points = points, .look = static_cast<int>(panel_.curves.size())});
  }

  [[nodiscard]] bool IsMarks(const WitnessRecord& record) const {
    return std::ranges::any_of(spec_.marks,
                               [&](const PlacedText& text) { return text.text == record.name; });
  }

  // The curve added last stands as markers.
  void MarkLast() {
    FigureCurve& curve = panel_.curves.back();
    curve.line = false;
    if (curve.points.size() > kMostMarks) curve.points = SomeOf(curve.points, 0.5);
    curve.marker = markers_++ % kMarkerShapes;
  }

  void LinePerWitness() {
    for (const std::string& channel : channels_) {
      for (const WitnessRecord* record : witnesses_) {
        const int column = record->trace.Find(channel);
        if (column < 0) continue;
        const PlotPoints points = FromStart(
            ValuesOf(record->trace, ForceSignal(record->trace, column)), spec_.from_start);
        const FigurePoints shown = spec_.x.given()
                                       ? OverSignal(*record, points)
                                       : Scaled(Thinned(points, kFigureBins), x_unit_, unit_);
        if (shown.empty()) continue;
        AddCurve(RowName(channel, SayWitnessOf(*record)), shown);
        if (IsMarks(*record)) MarkLast();
      }
    }
  }

  [[nodiscard]] std::string SayWitnessOf(const WitnessRecord& record) const {
    return SayWitness(record.name, language_);
  }

  [[nodiscard]] FigurePoints OverSignal(const WitnessRecord& record,
                                        const PlotPoints& points) const {
    FigurePoints shown;
    const int column = record.trace.Find(spec_.x.text);
    const size_t stride = 1 + points.size() / (2 * kFigureBins);
    for (size_t i = 0; column >= 0 && i < points.size(); i += stride) {
      shown.emplace_back(x_unit_.factor * record.trace.values(static_cast<Eigen::Index>(i), column),
                         unit_.factor * points[i].second);
    }
    return shown;
  }

  void Differences() {
    const Trace* truth = TraceOf(report_, spec_.against.text);
    if (truth == nullptr) {
      missing_.push_back(spec_.against.path + " = '" + spec_.against.text + "'");
      return;
    }
    for (const std::string& channel : channels_) {
      for (const WitnessRecord* record : witnesses_) {
        const int a = record->trace.Find(channel), b = truth->Find(channel);
        if (a < 0 || b < 0) continue;
        const PlotPoints points = DifferencesOf(record->trace, a, *truth, b);
        const std::string pair =
            SayWitnessOf(*record) + " − " + SayWitness(spec_.against.text, language_);
        AddCurve(RowName(channel, pair), Scaled(Shortened(points), x_unit_, unit_));
      }
    }
  }

  // Noise on a logarithmic scale: how large it becomes is what counts.
  [[nodiscard]] PlotPoints Shortened(const PlotPoints& points) const {
    return spec_.log ? Envelope(points, kDifferenceSpans) : Thinned(points, kFigureBins);
  }

  void NameAxes() {
    const bool one = channels_.size() == 1;
    const std::string usual = one ? NameOf(channels_.front()) : "";
    panel_.y.label = AxisLabel(spec_.label.empty() ? usual : spec_.label, "", unit_.shown);
    if (spec_.x.given()) {
      const std::string name = spec_.x_label.empty() ? NameOf(spec_.x.text) : spec_.x_label;
      panel_.x.label = AxisLabel(name, "", x_unit_.shown);
      return;
    }
    panel_.x.label = spec_.x_label.empty()
                         ? AxisLabel(WordFor(FigureWord::kTime, language_), "*t*", x_unit_.shown)
                         : AxisLabel(spec_.x_label, "", x_unit_.shown);
  }

  const PanelSpec& spec_;
  const Report& report_;
  const Language language_;
  std::vector<const WitnessRecord*> witnesses_;
  std::vector<std::string> channels_, missing_;
  std::string si_;
  int markers_ = 0;  // that were given
  ShownUnit unit_, x_unit_;
  FigurePanel panel_;
};

bool SameX(const std::vector<PanelSpec>& panels) {
  return std::ranges::all_of(panels, [&](const PanelSpec& panel) {
    return panel.x.text == panels.front().x.text && panel.x_unit.text == panels.front().x_unit.text;
  });
}

}  // namespace

FigureSet ComposeFigures(const std::vector<FigureSpec>& specs, const Report& report,
                         Language language) {
  FigureSet set;
  for (const FigureSpec& spec : specs) {
    Figure figure{.name = spec.name.text,
                  .caption = spec.caption,
                  .common_x = SameX(spec.panels),
                  .width_mm = spec.width_mm,
                  .height_mm = spec.height_mm};
    for (const PanelSpec& part : spec.panels) {
      PanelComposer composer(part, report, language);
      FigurePanel panel = composer.Compose();
      for (const std::string& what : composer.missing()) {
        set.left_out.push_back(
            fmt::format("{}: {}: no witness that is shown recorded it", spec.name.text, what));
      }
      if (!composer.empty() && !panel.curves.empty()) figure.panels.push_back(std::move(panel));
    }
    if (!figure.panels.empty()) set.figures.push_back(std::move(figure));
  }
  return set;
}

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
    run.points.progress = [&](std::uint64_t done, std::uint64_t all, double /*cpu_s*/) {
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
