#include "report/html_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/inputs.h"
#include "base/markup.h"
#include "base/roles.h"
#include "base/sha256.h"
#include "plot/svg_plot.h"
#include "report/load_figures.h"
#include "report/page.h"
#include "report/plot_points.h"
#include "report/result.h"
#include "report/sections.h"
#include "report/sizing.h"
#include "report/source_model_report.h"

namespace mbv {
namespace {

std::string At(double time_s) {
  return std::isfinite(time_s) ? fmt::format("{:.4g} s", time_s) : "";
}

}  // namespace

ReportSection DriveSection(const Report& report) {
  ReportSection section{.title = "Drives", .link = "Drives"};
  const PairComparison* main = report.comparison.MainPair();
  bool floored = false;
  for (const PairComparison& pair : report.comparison.pairs) {
    if (!pair.compared || pair.drives.empty()) continue;
    Table table{
        .caption = pair.measured + " against " + pair.truth,
        .columns = {Text("drive"), Spare(Digits("RMS force")), Digits("RMS error / RMS force"),
                    Digits("largest error"), Digits("at"), Digits("digits")}};
    for (const DriveMetrics& drive : pair.drives) {
      floored = floored || (drive.floored && &pair == main);
      table.rows.push_back({drive.drive, fmt::format("{:.6g} {}", drive.rms_truth, drive.unit),
                            NumberOrDash(drive.nrmse),
                            NumberOrDash(drive.max_error) + " " + drive.unit, At(drive.time_s),
                            Cell(NumberOrDash(drive.digits, "{:.1f}"), Mark::kNone,
                                 drive.floored ? "floored" : "")});
    }
    if (&pair == main) {
      section.Add(std::move(table));
    } else {
      const std::string title = table.caption;
      section.Add(Fold{title, {{std::move(table)}}}, On::kPage);
    }
  }
  if (floored) {
    section.Note(
        "floored: relative to 0.1 % of what the drive carries, which is more than its own force",
        On::kAll);
  }
  if (const std::string rest = AtRestText(report.comparison); !rest.empty()) {
    section.Note(Sentence(rest) + " Joint reactions are those without the resting force.");
  }
  return section;
}

ReportSection EngineSection(const Report& report) {
  ReportSection section{.title = "The simulator's own error", .link = "Engine"};
  if (!report.engine_comparison) return section;
  const EngineComparison& engine = *report.engine_comparison;
  Table friction{
      .caption = "Dry friction by MuJoCo's own frictionloss, against " + engine.truth,
      .columns = {Digits("step"), Text("misses farthest"), Digits("by"), Digits("limit")}};
  for (const FrictionError& e : engine.friction) {
    const std::string unit = e.unit.empty() ? "" : " " + e.unit;
    friction.rows.push_back({fmt::format("{:g} ms", 1e3 * e.step_s),
                             e.failure.empty() ? e.check : e.failure, NumberOrDash(e.value) + unit,
                             NumberOrDash(e.limit) + unit});
  }
  if (!engine.friction.empty()) {
    section.Add(std::move(friction), On::kPage);
    section.Note(Sentence(engine.FrictionText()), On::kAll);
  }
  Table table{.caption = "The same run by each engine, against " + engine.truth,
              .columns = {Text("engine"), Digits("force error, RMS"),
                          Digits(fmt::format("from {:g} s", engine.later_s)),
                          Digits("force error, largest", On::kPage), Digits("loop gap")}};
  for (const EngineError& e : engine.engines) {
    table.rows.push_back({EngineComparison::NameOf(e.engine), NumberOrDash(e.force_nrmse),
                          NumberOrDash(e.force_nrmse_later), NumberOrDash(e.force_max_rel),
                          NumberOrDash(e.closure_max_m) + " m"});
  }
  if (table.rows.empty()) return section;
  section.Add(std::move(table));
  for (const EngineError& e : engine.engines) {
    if (e.failure.empty()) continue;
    section.Note(fmt::format("{}: no result: {}", EngineComparison::NameOf(e.engine), e.failure),
                 On::kAll);
  }
  section.Note(
      "What MuJoCo as it is is off by is its own modelling error, not the equations'. Most of it "
      "are the first moments, in which its soft constraints take up the load.");
  return section;
}

// One column per witness that recorded its energies.
std::string EnergyHtml(const Report& report) {
  std::vector<const EnergyAudit*> audits;
  for (const WitnessMetrics& witness : report.comparison.witnesses) {
    if (witness.energy) audits.push_back(&*witness.energy);
  }
  if (audits.empty()) return "";
  Table table{
      .caption = "Energy balance at the end of the run [J]",
      .columns = {Text("of")},
  };
  for (const EnergyAudit* audit : audits) table.columns.push_back(Digits(audit->witness));
  const auto add = [&](const std::string& title, const auto& value) {
    std::vector<Cell> row = {title};
    for (const EnergyAudit* audit : audits) row.push_back(value(*audit));
    table.rows.push_back(std::move(row));
  };
  for (const EnergyPart& part : audits.back()->parts) {
    add((part.stored ? "change: " : "work: ") + part.name, [&](const EnergyAudit& audit) {
      for (const EnergyPart& own : audit.parts) {
        if (own.name == part.name) return NumberOrDash(own.end_J, "{:.6g}");
      }
      return NumberOrDash(kNan);
    });
  }
  add("drift: change − work",
      [](const EnergyAudit& audit) { return NumberOrDash(audit.end_drift_J); });
  add("largest drift", [](const EnergyAudit& audit) { return NumberOrDash(audit.drift_J); });
  add("largest drift / energy turned over",
      [](const EnergyAudit& audit) { return NumberOrDash(audit.drift.value); });
  add("work by", [](const EnergyAudit& audit) {
    return std::string(audit.integrated ? "integration" : "samples");
  });
  std::string html = ToHtml(table);
  for (const EnergyAudit* audit : audits) {
    if (audit->text.empty()) continue;
    html += "<p class=\"reason\">" + Escape(audit->witness + ": " + audit->text + ".") + "</p>\n";
  }
  return html + Note(
                    "Work that a witness does not integrate with its motion is the integral of "
                    "cubics through the samples; the drift then holds their error.");
}

std::string AuditHtml(const std::optional<HtmlAudit>& audit) {
  if (!audit) return "";
  if (!audit->note.empty()) return "<p>" + Escape(audit->note) + "</p>\n";
  size_t right = 0, corrected = 0, open = 0;
  Table table{
      .caption = "Every numbered equation",
      .columns = {Text("equation"), Text("status"), Text("as printed"), Text("corrected"),
                  Text("residual"), Text("note")},
  };
  for (const HtmlEquation& row : audit->rows) {
    right += row.right ? 1 : 0;
    corrected += row.corrected_right ? 1 : 0;
    open += row.right || row.corrected_right ? 0 : 1;
    const Mark mark = row.right ? Mark::kOk : row.corrected_right ? Mark::kWarn : Mark::kOff;
    table.rows.push_back({row.equation + (row.erratum.empty() ? "" : " " + row.erratum),
                          Cell(row.status, mark), row.printed, row.corrected, row.residual,
                          row.note});
  }
  return "<p>" + Escape(audit->source) +
         fmt::format(
             "</p>\n<p><b>{}</b> of {} rows are right as printed, <b>{}</b> are wrong as "
             "printed and corrected here, {} are labels, choices or claims that no "
             "residual decides.</p>\n",
             right, audit->rows.size(), corrected, open) +
         Folded("All rows", ToHtml(table));
}

std::string SignalsHtml(const Report& report) {
  if (report.sheets.empty()) return "";
  Table table{
      .caption = "Frame and sign of each force signal",
      .columns = {Text("signal"), Text("unit"), Text("acts on"), Text("exerted by"),
                  Text("frame and axis"), Text("positive means")},
  };
  for (const SignalSheet& sheet : report.sheets) {
    table.rows.push_back(
        {sheet.signal, sheet.unit, sheet.acts_on, sheet.exerted_by, sheet.frame, sheet.positive});
  }
  return ToHtml(table);
}

std::string TimesText(const Report& report) {
  const Timing& timing = report.timing;
  if (!timing.stated) return "";
  std::string times = fmt::format("analytic {:.3f} s, reference {:.3f} s, simulation {:.3f} s",
                                  timing.analytic_s, timing.reference_s, timing.simulation_s);
  if (timing.foreign_s > 0.0) {
    times += fmt::format(", foreign witnesses {:.3f} s", timing.foreign_s);
  }
  if (timing.stock_s > 0.0) times += fmt::format(", stock engine {:.3f} s", timing.stock_s);
  if (timing.render_s > 0.0) times += fmt::format(", pictures {:.3f} s", timing.render_s);
  if (timing.loop_s > 0.0 && timing.steps > 0) {
    times += fmt::format("; {} {}, {:.0f}/s", timing.steps,
                         report.mode == "forward" ? "steps" : "samples",
                         static_cast<double>(timing.steps) / timing.loop_s);
  }
  return times;
}

namespace {

// Forces of drives of one unit, and their errors below.
std::string ForcePlotsHtml(const PairComparison& pair, const Trace& measured, const Trace& truth,
                           const SharedAxis& axis) {
  const std::string y_label = fmt::format("[{}]", axis.unit);
  LinePlot forces{.title = fmt::format("Drive forces, {}", pair.measured),
                  .x_label = "time [s]",
                  .y_label = y_label};
  LinePlot errors{.title = fmt::format("Drive forces, |{} − {}|", pair.measured, pair.truth),
                  .x_label = "time [s]",
                  .y_label = y_label,
                  .log_y = true};
  for (const std::string& drive : axis.subjects) {
    const int column = measured.Find(Quantity::kForce, drive);
    const int other = truth.Find(Quantity::kForce, drive);
    if (other < 0) continue;
    const ForceSignal force(measured, column);
    forces.lines.push_back({.label = drive, .points = Thinned(ValuesOf(measured, force))});
    errors.lines.push_back(
        {.label = drive, .points = Thinned(DifferencesOf(measured, column, truth, other))});
    const PlotPoints strokes = StrokesOf(measured, force);
    if (!strokes.empty()) forces.lines.push_back({.label = drive + ", at rest", .points = strokes});
  }
  if (forces.lines.empty()) return "";
  return FigureHtml(ToSvg(forces)) + FigureHtml(ToSvg(errors));
}

}  // namespace

std::string StaticPlotsHtml(const Report& report) {
  const PairComparison* pair = report.comparison.MainPair();
  if (pair == nullptr) return "";
  const Trace* measured = TraceOf(report, pair->measured);
  const Trace* truth = TraceOf(report, pair->truth);
  if (measured == nullptr || truth == nullptr) return "";
  std::string html;
  for (const SharedAxis& axis : ByUnit(*measured, Quantity::kForce, report.drives)) {
    html += ForcePlotsHtml(*pair, *measured, *truth, axis);
  }
  return html.empty() ? "" : "<div class=\"static-plots\">\n" + html + "</div>\n";
}

// report.html of a motion: what its page has beyond those of other kinds, data and script behind
// it.

namespace {

constexpr const char* kHowToReadChecks =
    "The margin is the limit over the value; a full bar is ten decimal digits. Held: a drive "
    "motion compared with itself, which verifies nothing.";

constexpr const char* kReplayPlace = "<div id=\"replay-view\"></div>\n";

// Only our own script runs: the one in the page by its hash, a shared one by its origin.
void AddScripts(const HtmlInput& input, PageHead* head) {
  static const std::string hash = CspHash(PageScript());
  const bool own = input.script_link.empty();
  head->script_source = own ? hash : "'self'";
  head->scripts =
      "<script type=\"application/json\" id=\"page-data\">" + PageData(input) + "</script>\n" +
      (own ? fmt::format("<script>{}</script>", PageScript())
           : fmt::format("<script src=\"{}\"></script>", EncodeLink(input.script_link))) +
      "\n";
}

class PageWriter {
 public:
  explicit PageWriter(const HtmlInput& input)
      : input_(input), report_(*input.report), view_(ViewOf(report_)) {}

  std::string Write() {
    page_.Add("Verdict", "Verdict", VerdictHtml(view_, Cards(), About()));
    Interactive();
    Pictures();
    page_.Add("Checks", "Checks", PairsHtml() + ChecksHtml(view_, kHowToReadChecks));
    page_.Add(ReferenceTableSection(report_, false));
    page_.Add(MotionTableSection(report_, true));
    page_.Add(DriveSection(report_));
    page_.Add("What drives and joints bear", "Loads", LoadsHtml(report_));
    page_.Add("Motors", "Motors", SizingHtml(report_));
    page_.Add(PhaseSection(report_));
    page_.Add(ContactSection(report_));
    page_.Add(EventSection(report_, false));
    page_.Add(SingularitySection(report_, false));
    page_.Add(EngineSection(report_));
    if (report_.source_model != nullptr) {
      page_.Add(SourceModelSection(*report_.source_model, false));
    }
    for (const ReportPart& part : report_.parts) page_.Add(part.section);
    page_.Add("Energy", "Energy", EnergyHtml(report_));
    page_.Add("What could not be compared", "Gaps", GapsHtml(view_, true));
    page_.Add("The paper's equations", "Equations", AuditHtml(input_.audit));
    page_.Add("How to read the force signals", "Signals", SignalsHtml(report_));
    page_.Add("Parameters", "Parameters", ParametersHtml(input_.mechanism->parameters, true));
    page_.Add("Reproduce this run", "Reproduce", Reproduce());
    return page_.Write(Head());
  }

 private:
  // How it was simulated, and what drives it.
  std::string About() const {
    std::string html = Escape(Sentence(report_.simulation));
    if (!report_.comparison.driving.empty()) {
      html += " " + Escape(Sentence(report_.comparison.driving));
    }
    if (report_.start_window_s > 0.0) {
      html += fmt::format(" Start-up window: forces before {:g} s are not judged.",
                          report_.start_window_s);
    }
    return html;
  }

  std::string PairsHtml() const {
    const Table pairs = PairMatrix(report_.comparison);
    return pairs.rows.empty() ? "" : ToHtml(pairs);
  }

  std::string Cards() const {
    std::string html;
    if (const PairComparison* pair = report_.comparison.MainPair()) {
      html += ForceCards(*pair);
    }
    for (const WitnessMetrics& witness : report_.comparison.witnesses) {
      if (!IsEngine(witness.witness)) continue;
      const auto add = [&](Metric metric, const char* title, const char* unit) {
        const auto found = witness.metrics.find(metric);
        if (found == witness.metrics.end()) return;
        html += Card(title, fmt::format("{:.1e}{}", found->second.value, unit),
                     fmt::format("simulated, worst at {:.4g} s", found->second.time_s));
      };
      add(Metric::kClosureM, "Largest loop gap", " m");
      add(Metric::kPower, "Power balance", "");
    }
    return html + CountCards();
  }

  std::string ForceCards(const PairComparison& pair) const {
    std::string html;
    const auto nrmse = pair.metrics.find(Metric::kForceNrmse);
    const bool is_floored = nrmse != pair.metrics.end() && nrmse->second.floored;
    const std::string floored = is_floored ? ", floored" : "";
    if (nrmse != pair.metrics.end()) {
      const CheckResult* check = report_.comparison.FindCheck(pair.name() + ".force_nrmse");
      html +=
          Card("Drive force error, RMS", fmt::format("{:.1e}", nrmse->second.value),
               pair.measured + " against " + pair.truth +
                   (check != nullptr && check->limit ? fmt::format(", limit {:.0e}", *check->limit)
                                                     : "") +
                   floored);
    }
    if (std::isfinite(pair.digits)) {
      html += Card("Matching digits", fmt::format("{:.1f}", pair.digits),
                   "of all drive forces" + floored);
    }
    const auto worst = pair.metrics.find(Metric::kForceMax);
    if (worst != pair.metrics.end()) {
      html += Card("Worst sample", fmt::format("{:.1e}", worst->second.value),
                   fmt::format("{} at {:.4g} s", worst->second.channel, worst->second.time_s));
    }
    return html;
  }

  std::string CountCards() const {
    return Card("Checks that verify", fmt::format("{} of {}", view_.verified, view_.limits()),
                fmt::format("{} of {} witnesses ran, {} of {} pairs were compared", view_.ran(),
                            std::max<size_t>(3, view_.witnesses.size()), view_.pairs_compared,
                            std::max<size_t>(3, view_.pairs)));
  }

  // Filled by the script; without it, plots that do not move.
  void Interactive() {
    page_.Add(
        "Replay", "Replay",
        "<noscript><p class=\"faint\">The replay needs JavaScript; the pictures below do not.</p>"
        "</noscript>\n" +
            std::string(kReplayPlace));
    page_.Add("Signals over time", "Plots",
              "<noscript><p class=\"faint\">Without JavaScript the plots do not zoom.</p>\n" +
                  StaticPlotsHtml(report_) + "</noscript>\n<div id=\"plot-view\"></div>\n");
  }

  void Pictures() {
    std::string html;
    for (const HtmlPicture& picture : input_.pictures) {
      const std::string name = Escape(picture.name);
      html += fmt::format(
          "<a href=\"snapshots/{2}\"><img loading=\"lazy\" alt=\"The mechanism in the simulation, "
          "{0}\" src=\"data:image/png;base64,{1}\"></a>\n",
          name, Base64(std::string_view(picture.png)), EncodeLink(picture.name));
    }
    if (html.empty()) return;
    page_.Add("Snapshots", "Snapshots",
              "<div class=\"pictures\">\n" + html +
                  "</div>\n<p class=\"faint\">Small copies; the originals are in snapshots/ beside "
                  "this page.</p>\n");
  }

  [[nodiscard]] PageHead Head() const {
    PageHead head = HeadOf(view_);
    head.kicker = "mbverify report";
    head.footer =
        "Written by mbverify. Forces, errors and poses are embedded; all digits are in traces.csv "
        "and summary.json.";
    AddScripts(input_, &head);
    return head;
  }

  [[nodiscard]] std::string Reproduce() const {
    std::string command = "mbverify run " + report_.scenario_file;
    for (const std::string& argument : input_.arguments) command += " " + argument;
    return ReproduceHtml(view_, command, TimesText(report_),
                         "Files beside this page: summary.json (every number), traces.csv (17 "
                         "digits), model.xml (the MJCF as simulated).");
  }

  const HtmlInput& input_;
  const Report& report_;
  const ResultView view_;
  Page page_;
};

}  // namespace

std::string SharedScriptName() {
  return fmt::format("report-{}.js", ContentFingerprint(std::string(PageScript())));
}

void AddReplay(const Mechanism& mechanism, const std::vector<std::vector<Pose>>& X_WB,
               const std::vector<double>& time_s, std::map<std::string, HtmlPaint> paints,
               const std::string& title, const std::string& remark, Page* page, PageHead* head) {
  Report report;
  report.mechanism = mechanism.name, report.scenario = title;
  WitnessRecord& moving = report.witnesses.emplace_back();
  moving.name = role::kSimulated.name;
  moving.trace.time_s = time_s;
  HtmlInput input;
  input.report = &report, input.mechanism = &mechanism, input.X_WB = &X_WB;
  input.paints = std::move(paints);
  page->Add(title, "Motion",
            kReplayPlace + Note(remark) +
                "<noscript><p class=\"faint\">It needs JavaScript.</p></noscript>\n");
  AddScripts(input, head);
}

std::string ToHtml(const HtmlInput& input) { return PageWriter(input).Write(); }

// What drives and joints bear, as tables of report.html.

namespace {

constexpr size_t kOpenRows = 12;  // longer tables are folded

std::string FigureElement(double value, const std::string& unit) {
  return std::isfinite(value) ? fmt::format("{:.5g} {}", value, unit) : "–";
}

std::string PeakTime(double time_s) {
  return std::isfinite(time_s) ? fmt::format("{:.4g} s", time_s) : "";
}

void AddFigures(const Figures& figures, std::vector<Cell>* row) {
  row->push_back(FigureElement(figures.peak, figures.unit));
  row->push_back(PeakTime(figures.time_s));
  row->push_back(FigureElement(figures.rms, figures.unit));
  row->push_back(FigureElement(figures.mean, figures.unit));
}

Table DriveTable(const std::vector<DriveLoad>& loads, const std::string& witness) {
  Table table{
      .caption = "Drives, " + witness,
      .columns = {Text("drive"), Digits("force, peak"), Digits("at"), Digits("RMS"), Digits("mean"),
                  Digits("power, peak"), Digits("at"), Digits("RMS"), Digits("mean"),
                  Digits("stroke"), Digits("speed, peak"), Digits("speed, RMS")},
  };
  for (const DriveLoad& load : loads) {
    if (load.witness != witness) continue;
    std::vector<Cell> row = {load.drive};
    AddFigures(load.force, &row);
    AddFigures(load.power, &row);
    row.push_back(FigureElement(load.stroke, load.stroke_unit));
    row.push_back(FigureElement(load.speed.peak, load.speed.unit));
    row.push_back(FigureElement(load.speed.rms, load.speed.unit));
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table JointTable(const std::vector<JointLoad>& loads, const std::string& witness) {
  Table table{
      .caption = "Joint reactions, magnitudes, " + witness,
      .columns = {Text("joint"), Digits("force, peak"), Digits("at"), Digits("RMS"), Digits("mean"),
                  Digits("moment, peak"), Digits("at"), Digits("RMS"), Digits("mean")},
  };
  for (const JointLoad& load : loads) {
    if (load.witness != witness) continue;
    std::vector<Cell> row = {Cell(load.joint, Mark::kNone, load.not_unique ? "not unique" : "")};
    AddFigures(load.force, &row);
    AddFigures(load.moment, &row);
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string Shown(const Table& table, bool open) {
  if (table.rows.empty()) return "";
  return open ? ToHtml(table) : Folded(table.caption, ToHtml(table));
}

// What the others are measured against the main pair's first witness; else the first that ran.
std::string MainWitness(const Report& report, const LoadFigures& loads) {
  const PairComparison* pair = report.comparison.MainPair();
  return pair != nullptr ? pair->measured : loads.drives.front().witness;
}

}  // namespace

std::string LoadsHtml(const Report& report) {
  const LoadFigures loads = LoadFiguresOf(report);
  if (loads.drives.empty() && loads.joints.empty()) return "";
  const std::string main =
      loads.drives.empty() ? loads.joints.front().witness : MainWitness(report, loads);
  std::string html = Shown(DriveTable(loads.drives, main), true);
  const Table joints = JointTable(loads.joints, main);
  html += Shown(joints, joints.rows.size() <= kOpenRows);
  bool open = false;
  for (const WitnessRecord& record : report.witnesses) {
    if (record.name == main) continue;
    html += Shown(DriveTable(loads.drives, record.name), false);
    html += Shown(JointTable(loads.joints, record.name), false);
  }
  for (const JointLoad& load : loads.joints) open = open || load.not_unique;
  for (const auto& [witness, why] : loads.unresolved) {
    html +=
        Note(Escape(fmt::format("{}: peaks, means and powers between the samples are not known: "
                                "{}.",
                                witness, why)));
  }
  return html +
         Note(std::string("Peak: the value of largest magnitude. RMS and mean are over time. "
                          "Power is force times speed, positive into the mechanism. Reactions "
                          "are what joints transmit, drive forces excluded") +
              (open ? "; where statics leaves them open, one choice of many." : "."));
}

}  // namespace mbv
