#include "report/sections.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

#include "base/text.h"
#include "plot/svg_plot.h"
#include "report/page.h"
#include "report/plot_points.h"

namespace mbv {

namespace {

using Json = nlohmann::ordered_json;
using Limit = ContactLoad::Limit;

// Of the witness that is shown first.
std::vector<const ContactLoad*> MainContactLoads(const Report& report) {
  const PairComparison* pair = report.comparison.MainPair();
  std::vector<const ContactLoad*> loads;
  for (const std::string& witness :
       {pair != nullptr ? pair->measured : "", pair != nullptr ? pair->truth : "",
        report.contact_loads.empty() ? "" : report.contact_loads.front().witness}) {
    for (const ContactLoad& load : report.contact_loads) {
      if (load.witness == witness) loads.push_back(&load);
    }
    if (!loads.empty()) break;
  }
  return loads;
}

Cell UseCell(const ContactLoad& load, Limit limit) {
  const ContactLoad::Use* use = load.Find(limit);
  if (use == nullptr) return "–";
  const Mark mark = use->exceeded() ? Mark::kWarn : Mark::kNone;
  switch (limit) {
    case Limit::kLift:
      return {fmt::format("{:.4g} N", use->worst), mark};
    case Limit::kSlip:
      return {std::isnan(use->allowed) ? fmt::format("{:.3g}", use->worst)
                                       : fmt::format("{:.3g} of {:.3g}", use->worst, use->allowed),
              mark};
    case Limit::kTip:
      return {fmt::format("{:.3g} mm", 1e3 * use->worst), mark};
    case Limit::kTwist:
      return {std::isnan(use->allowed)
                  ? fmt::format("{:.3g} mm", 1e3 * use->worst)
                  : fmt::format("{:.3g} of {:.3g} mm", 1e3 * use->worst, 1e3 * use->allowed),
              mark};
    case Limit::kFall:
      return {std::isinf(use->worst) ? "any fails" : fmt::format("{:.3g} × stated", use->worst),
              mark};
  }
  return "–";
}

std::string HoldText(const ContactLoad& load) {
  std::string text;
  for (const ContactLoad::Use& use : load.uses) {
    if (!use.exceeded()) continue;
    text += fmt::format("{}{}s from {:.4g} s on", text.empty() ? "" : ", ", ToText(use.limit),
                        use.from_s);
  }
  if (text.empty()) text = "holds";
  return load.unique() ? text : text + " (one share of many)";
}

std::string NameInPhase(const ContactLoad& load) {
  return load.phase.empty() ? load.name() : fmt::format("{}, {}", load.phase, load.name());
}

// Lengths in millimetres.
std::string PressureSvg(const ContactLoad& load) {
  LinePlot plot{.title = NameInPhase(load) + ": centre of pressure",
                .x_label = "x [mm]",
                .y_label = "y [mm]"};
  PlotLine outline{.label = "ground contact"};
  for (const Eigen::Vector2d& p : load.outline) {
    outline.points.emplace_back(1e3 * p.x(), 1e3 * p.y());
  }
  if (outline.points.size() > 2) outline.points.push_back(outline.points.front());
  PlotLine path{.label = load.witness};
  const size_t stride = 1 + load.pressure.size() / 1500;
  for (size_t i = 0; i < load.pressure.size(); i += stride) {
    path.points.emplace_back(1e3 * load.pressure[i].x(), 1e3 * load.pressure[i].y());
  }
  plot.lines = {std::move(outline), std::move(path)};
  return ToSvg(plot);
}

}  // namespace

ReportSection PhaseSection(const Report& report) {
  ReportSection section{.title = "Phases", .link = "Phases"};
  if (report.phases.empty()) return section;
  Table table{.name = "phases",
              .caption = "Phases",
              .columns = {Text("phase"), Digits("from"), Digits("to"), Text("feet on the ground"),
                          Text("verdict"), Text("worst check"), Digits("of its limit")}};
  for (const PhaseLine& phase : report.phases) {
    const Mark mark = phase.verdict == Verdict::kAgree ? Mark::kOk : Mark::kFail;
    table.rows.push_back(
        {phase.name, fmt::format("{:g} s", phase.from_s), fmt::format("{:g} s", phase.to_s),
         phase.contacts.empty() ? "none" : Joined(phase.contacts, 6),
         Cell(phase.verdict == Verdict::kAgree      ? "agree"
              : phase.verdict == Verdict::kDisagree ? "disagree"
                                                    : "not run",
              mark),
         phase.worst_check,
         phase.worst_check.empty() ? "–" : fmt::format("{:.2g}", phase.worst_use)});
  }
  section.Add(std::move(table));
  section.Note(
      "Each phase is a mechanism of its own with its feet held, computed and judged from its first "
      "to its last sample. Where two phases meet forces jump: both judge that instant, with their "
      "own forces, and traces and plots show those of the phase that begins.",
      On::kAll);
  return section;
}

namespace {

constexpr size_t kMostEvents = 200;  // that a page lists

std::vector<const Trace*> TracesWithEvents(const Report& report) {
  std::vector<const Trace*> traces;
  for (const WitnessRecord& witness : report.witnesses) {
    if (!witness.trace.events.empty()) traces.push_back(&witness.trace);
  }
  return traces;
}

// Of each event its counterpart in another witness' trace, the one as late in the history of its
// element; null where there the element does something else.
std::vector<const MotionEvent*> Counterparts(const Trace& of, const Trace& in) {
  std::map<std::string, std::vector<const MotionEvent*>> histories;
  for (const MotionEvent& event : in.events) histories[event.element].push_back(&event);
  std::map<std::string, size_t> next;
  std::vector<const MotionEvent*> found;
  for (const MotionEvent& event : of.events) {
    const auto& history = histories[event.element];
    const size_t k = next[event.element]++;
    found.push_back(k < history.size() && history[k]->what == event.what ? history[k] : nullptr);
  }
  return found;
}

}  // namespace

ReportSection EventSection(const Report& report, bool verbose) {
  ReportSection section{.title = "Events", .link = "Events"};
  const std::vector<const Trace*> traces = TracesWithEvents(report);
  if (traces.empty()) return section;
  const Trace& first = *traces.front();
  const On on = verbose ? On::kAll : On::kPage;
  Table table{.name = "events",
              .caption = "Events between samples, " + first.witness,
              .columns = {Digits("time"), Text("element"), Text("what")}};
  const size_t listed = std::min(first.events.size(), kMostEvents);
  for (const MotionEvent& event : std::span(first.events).first(listed)) {
    table.rows.push_back(
        {fmt::format("{:.9g} s", event.time_s), Code(event.element), ToText(event.what)});
  }
  std::vector<std::string> notes;
  for (const Trace* other : std::span(traces).subspan(1)) {
    const std::vector<const MotionEvent*> same = Counterparts(first, *other);
    table.columns.push_back(Digits(other->witness + ", later by"));
    double farthest = 0.0;
    size_t count = 0;
    for (size_t i = 0; i < same.size(); ++i) {
      const double later = same[i] == nullptr ? kNan : same[i]->time_s - first.events[i].time_s;
      if (i < listed) table.rows[i].emplace_back(same[i] ? fmt::format("{:.2g} s", later) : "–");
      if (same[i] == nullptr) continue;
      farthest = std::max(farthest, std::abs(later));
      ++count;
    }
    const bool all = count == same.size() && count == other->events.size();
    notes.push_back(
        all ? fmt::format("{} and {} have the same {} events, times within {:.2g} s.",
                          first.witness, other->witness, count, farthest)
            : fmt::format("{} of {} events of {} are among the {} of {}, times within {:.2g} s.",
                          count, same.size(), first.witness, other->events.size(), other->witness,
                          farthest));
  }
  section.Add(std::move(table), on);
  if (listed < first.events.size()) {
    section.Note(fmt::format("{} more are in summary.json.", first.events.size() - listed), on);
  }
  for (std::string& note : notes) section.Note(std::move(note), on);
  return section;
}

nlohmann::ordered_json EventsJson(const Report& report) {
  auto json = nlohmann::ordered_json::array();
  for (const Trace* trace : TracesWithEvents(report)) {
    for (const MotionEvent& event : trace->events) {
      json.push_back({{"witness", trace->witness},
                      {"time_s", Number(event.time_s)},
                      {"element", event.element},
                      {"what", ToText(event.what)}});
    }
  }
  return json;
}

ReportSection ContactSection(const Report& report) {
  ReportSection section{.title = "Feet on the ground", .link = "Contacts"};
  const std::vector<const ContactLoad*> loads = MainContactLoads(report);
  if (loads.empty()) return section;
  Table table{
      .name = "contacts",
      .caption = "Feet on the ground, " + loads.front()->witness,
      .columns = {Text(report.phases.empty() ? "foot" : "phase, foot"), Text("kind"),
                  Digits("normal force, least"), Digits("most"), Digits("friction needed"),
                  Digits("centre of pressure inside by"), Spare(Digits("twist")), Text("")}};
  for (const ContactLoad* load : loads) {
    const bool exceeded =
        std::ranges::any_of(load->uses, [](const ContactLoad::Use& use) { return use.exceeded(); });
    table.rows.push_back({NameInPhase(*load), load->kind, UseCell(*load, Limit::kLift),
                          std::isnan(load->most_normal)
                              ? Cell("–")
                              : Cell(fmt::format("{:.4g} N", load->most_normal)),
                          UseCell(*load, load->Find(Limit::kFall) ? Limit::kFall : Limit::kSlip),
                          UseCell(*load, Limit::kTip), UseCell(*load, Limit::kTwist),
                          Cell(HoldText(*load), exceeded ? Mark::kWarn : Mark::kOk)});
  }
  section.Add(std::move(table));
  const bool shared =
      std::ranges::any_of(loads, [](const ContactLoad* load) { return !load->unique(); });
  const auto feet = [&](const std::string& phase) {
    return std::ranges::count(loads, phase, [](const ContactLoad* load) { return load->phase; });
  };
  const bool together =
      std::ranges::any_of(loads, [](const ContactLoad* load) { return load->contact.empty(); });
  const bool several =
      std::ranges::any_of(loads, [&](const ContactLoad* load) { return feet(load->phase) > 1; });
  if (shared) {
    section.Note(
        fmt::format("Statics leaves open what the feet share of the forces: of all shares "
                    "the one with the least drive forces is shown.{}",
                    together ? " What all feet bear together follows from the motion." : ""),
        On::kAll);
  }
  if (several && !together) {
    section.Note(
        "What all feet bear together is not judged: something else ties the robot to the ground, "
        "or they do not stand on one plane and some state no friction or size.",
        On::kAll);
  }
  for (const ContactLoad* load : loads) {
    if (load->outline.size() > 2 && !load->pressure.empty()) {
      section.Add(Drawing{PressureSvg(*load)}, On::kPage);
    }
  }
  section.Note(
      "Both computations hold the feet; whether the ground can is judged here. Ground only pushes; "
      "friction needed is the tangential over the normal force; the centre of pressure must stay "
      "within what touches the ground.");
  return section;
}

Json ContactsJson(const Report& report) {
  Json contacts = Json::array();
  for (const ContactLoad& load : report.contact_loads) {
    Json limits = Json::array();
    for (const ContactLoad::Use& use : load.uses) {
      limits.push_back({{"of", ToText(use.limit)},
                        {"worst", Number(use.worst)},
                        {"time_s", Number(use.time_s)},
                        {"allowed", Number(use.allowed)},
                        {"exceeded", use.exceeded()},
                        {"unique", use.unique},
                        {"from_s", Number(use.from_s)},
                        {"samples", use.beyond}});
    }
    Json contact = {{"contact", load.contact}, {"kind", load.kind}, {"witness", load.witness}};
    if (!load.phase.empty()) contact["phase"] = load.phase;
    contact["most_normal_N"] = Number(load.most_normal);
    contact["mean_normal_N"] = Number(load.mean_normal);
    contact["limits"] = std::move(limits);
    contacts.push_back(std::move(contact));
  }
  return contacts;
}

Json PhasesJson(const Report& report) {
  Json phases = Json::array();
  for (const PhaseLine& phase : report.phases) {
    phases.push_back({{"name", phase.name},
                      {"from_s", Number(phase.from_s)},
                      {"to_s", Number(phase.to_s)},
                      {"contacts", phase.contacts},
                      {"verdict", ToText(phase.verdict)},
                      {"reason", phase.reason},
                      {"worst_check", phase.worst_check},
                      {"worst_use", Number(phase.worst_use)}});
  }
  return phases;
}

namespace {

using Json = nlohmann::ordered_json;

// Of the second derivative's mean square: 1 % of its RMS is reported unasked.
constexpr double kReportedShare = 1e-4;

std::string SmoothingText(const MotionTable& table) {
  if (!table.smoothed()) return "none";
  return fmt::format(
      "{}, deviation {:.2g} {}{}", table.smoothing, table.deviation, table.unit,
      std::isfinite(table.cutoff_hz) ? fmt::format(", halves {:.3g} Hz", table.cutoff_hz) : "");
}

std::string KindText(const MotionTable& table) {
  return fmt::format("{} rows{}, {:.6g} … {:.6g} s{}", table.rows,
                     table.with_rates ? " with rates" : "", table.from_s, table.to_s,
                     table.periodic ? ", repeated" : "");
}

std::string ChangeText(double rms, double max, const std::string& unit) {
  return fmt::format("RMS {:.2e}, at most {:.2e} {}", rms, max, unit);
}

Table TablesTable(const Report& report) {
  Table html{
      .caption = "Tables and their splines",
      .columns = {Text("of"), Text("file"), Text("column"), Text("rows"), Text("smoothing"),
                  Digits("smoothing changes by"), Digits("its second derivative by"),
                  Digits("which is (RMS)")},
  };
  for (const MotionTable& table : report.tables) {
    html.rows.push_back({table.name, table.file, table.column, KindText(table),
                         SmoothingText(table),
                         ChangeText(table.change_rms, table.change_max, table.unit),
                         ChangeText(table.acceleration_change_rms, table.acceleration_change_max,
                                    table.unit + "/s²"),
                         fmt::format("{:.5g} {}/s²", table.acceleration_rms, table.unit)});
  }
  return html;
}

Table ForcesTable(const Report& report) {
  Table html{
      .caption = "What smoothing takes out of the drive forces",
      .columns = {Text("drive"), Digits("force, RMS"), Digits("change, RMS"),
                  Digits("change, largest")},
  };
  for (const SmoothedForce& force : report.smoothed_forces) {
    html.rows.push_back({force.drive, fmt::format("{:.6g} {}", force.rms, force.unit),
                         fmt::format("{:.3e} {}", force.change_rms, force.unit),
                         fmt::format("{:.3e} {}", force.change_max, force.unit)});
  }
  return html;
}

}  // namespace

ReportSection MotionTableSection(const Report& report, bool verbose) {
  ReportSection section{.title = "Tables that command the motion", .link = "Tables"};
  if (report.tables.empty()) return section;
  section.Add(TablesTable(report), On::kPage);
  Items lines;
  for (const MotionTable& table : report.tables) {
    lines.texts.push_back(fmt::format("{} follows column '{}' of {}: {}; smoothing: {}", table.name,
                                      table.column, table.file, KindText(table),
                                      SmoothingText(table)));
    if (table.moves && (verbose || table.smoothed() || table.noise_share() > kReportedShare)) {
      lines.texts.push_back(
          fmt::format("  {} by {}, the second derivative by {} (RMS of all: {:.4g})",
                      table.smoothed() ? "smoothing changes it" : "smoothing: auto would change it",
                      ChangeText(table.change_rms, table.change_max, table.unit),
                      ChangeText(table.acceleration_change_rms, table.acceleration_change_max,
                                 table.unit + "/s²"),
                      table.acceleration_rms));
    }
    if (!verbose) continue;
    for (const std::string& note : table.notes) lines.texts.push_back("  " + note);
  }
  section.Add(std::move(lines), On::kTerminal);
  section.Note(
      "Quintic splines through all rows, or as near as their noise allows. Without smoothing, the "
      "changes are those that smoothing: auto would make: they are what noise and rounding of the "
      "rows add to the second derivative, which drive forces follow.");
  section.Add(ForcesTable(report));
  return section;
}

Json MotionTableJson(const Report& report) {
  Json tables = Json::array(), forces = Json::array();
  for (const MotionTable& table : report.tables) {
    tables.push_back({{"of", table.name},
                      {"file", table.file},
                      {"column", table.column},
                      {"unit", table.unit},
                      {"rows", table.rows},
                      {"from_s", Number(table.from_s)},
                      {"to_s", Number(table.to_s)},
                      {"periodic", table.periodic},
                      {"with_rates", table.with_rates},
                      {"smoothing", table.smoothing},
                      {"deviation", Number(table.deviation)},
                      {"cutoff_hz", Number(table.cutoff_hz)},
                      {"change_rms", Number(table.change_rms)},
                      {"change_max", Number(table.change_max)},
                      {"acceleration_change_rms", Number(table.acceleration_change_rms)},
                      {"acceleration_change_max", Number(table.acceleration_change_max)},
                      {"acceleration_rms", Number(table.acceleration_rms)},
                      {"noise_share", Number(table.noise_share())},
                      {"notes", table.notes}});
  }
  for (const SmoothedForce& force : report.smoothed_forces) {
    forces.push_back({{"drive", force.drive},
                      {"unit", force.unit},
                      {"rms", Number(force.rms)},
                      {"change_rms", Number(force.change_rms)},
                      {"change_max", Number(force.change_max)}});
  }
  return {{"tables", std::move(tables)}, {"smoothed_forces", std::move(forces)}};
}

namespace {

constexpr size_t kMostPlots = 8;  // columns, the worst first

std::string NumberOrOff(double value, const char* format = "{:.2e}") {
  if (std::isinf(value)) return "off";
  return std::isnan(value) ? "–" : fmt::format(fmt::runtime(format), value);
}

const TableColumn& SourceOf(const TableVerdict& table, const TableColumnResult& column) {
  return table.columns[column.column];
}

// Worst first; columns without a number count as worst.
std::vector<const TableColumnResult*> ByRatio(const PairComparison& pair) {
  std::vector<const TableColumnResult*> columns;
  for (const TableColumnResult& column : pair.columns) columns.push_back(&column);
  const auto key = [](const TableColumnResult* column) {
    const double ratio = column->ratio();
    return std::isnan(ratio) ? std::numeric_limits<double>::infinity() : ratio;
  };
  std::stable_sort(columns.begin(), columns.end(),
                   [&](const auto* a, const auto* b) { return key(a) > key(b); });
  return columns;
}

Table ColumnTable(const TableVerdict& table, const PairComparison& pair, bool verbose) {
  Table columns{.caption = fmt::format("Columns of {} against {}, worst first", table.name,
                                       table.judged_against),
                .columns = {Text("signal"), Text("column", On::kPage), Digits("RMS"),
                            Digits("uncertainty"), Text("of it", verbose ? On::kAll : On::kPage),
                            Digits("RMS difference"), Digits("tube"), Digits("largest difference"),
                            Digits("tube"), Digits("at", On::kPage), Text("")}};
  for (const TableColumnResult* column : ByRatio(pair)) {
    const TableColumn& source = SourceOf(table, *column);
    columns.rows.push_back(
        {column->channel, source.heading, NumberOrOff(column->rms, "{:.6g} ") + source.channel.unit,
         NumberOrOff(column->standard), UncertaintyText(table.uncertainty[column->column]),
         NumberOrOff(column->error_rms), NumberOrOff(column->tube_rms),
         NumberOrOff(column->error_max), NumberOrOff(column->tube_max),
         NumberOrOff(column->time_s, "{:.4g} s"),
         column->inside() ? Cell("inside", Mark::kOk)
         : table.judged   ? Cell("OUTSIDE", Mark::kFail)
                          : Cell("not judged", Mark::kOff)});
  }
  return columns;
}

// The table's values with their tube on the other witness' curve, and the difference in the tube.
void AddPlots(const Report& report, const PairComparison& pair, ReportSection* section) {
  const TableVerdict& table = *report.comparison.table;
  const Trace* values = TraceOf(report, role::kReference.name);
  const Trace* other = TraceOf(report, table.judged_against);
  if (values == nullptr || other == nullptr) return;
  const std::vector<const TableColumnResult*> columns = ByRatio(pair);
  for (size_t k = 0; k < std::min(kMostPlots, columns.size()); ++k) {
    const TableColumnResult& column = *columns[k];
    const int a = values->Find(column.channel), b = other->Find(column.channel);
    if (a < 0 || b < 0) continue;
    const std::string& unit = SourceOf(table, column).channel.unit;
    PlotPoints points, curve, upper, lower, difference;
    for (const auto& [i, j] : AlignSamples(*values, *other)) {
      const double t = values->time_s[static_cast<size_t>(i)];
      const double value = values->values(i, a);
      const double error = value - other->values(j, b);
      points.emplace_back(t, value);
      upper.emplace_back(t, value + column.tube_max);
      lower.emplace_back(t, value - column.tube_max);
      difference.emplace_back(t,
                              unit == "rad" ? AngleDifference(value, other->values(j, b)) : error);
    }
    for (size_t i = 0; i < other->time_s.size(); ++i) {
      curve.emplace_back(other->time_s[i], other->values(static_cast<Eigen::Index>(i), b));
    }
    if (difference.empty()) continue;
    const double from = difference.front().first, to = difference.back().first;
    LinePlot signal{.title = column.channel, .x_label = "time [s]", .y_label = "[" + unit + "]"};
    signal.lines = {{.label = table.judged_against, .points = Thinned(curve)},
                    {.label = table.name, .points = Thinned(points), .markers = true},
                    {.label = "tube", .points = Thinned(upper)},
                    {.label = "", .points = Thinned(lower)}};
    LinePlot error{
        .title = fmt::format("{}: {} − {}", column.channel, table.name, table.judged_against),
        .x_label = "time [s]",
        .y_label = "[" + unit + "]"};
    error.lines = {{.label = "difference", .points = Thinned(difference), .markers = true},
                   {.label = fmt::format("tube ±{:.2g}", column.tube_max),
                    .points = {{from, column.tube_max}, {to, column.tube_max}}},
                   {.label = "", .points = {{from, -column.tube_max}, {to, -column.tube_max}}}};
    section->Add(Drawing{ToSvg(signal)});
    section->Add(Drawing{ToSvg(error)});
  }
  if (columns.size() > kMostPlots) {
    section->Note(fmt::format("The {} worst of {} columns.", kMostPlots, columns.size()));
  }
}

}  // namespace

const PairComparison* TablePair(const Comparison& comparison) {
  if (!comparison.table || comparison.table->judged_against.empty()) return nullptr;
  for (const PairComparison& pair : comparison.pairs) {
    const std::string& other = pair.measured == role::kReference ? pair.truth : pair.measured;
    const bool of_table = pair.Involves(role::kReference);
    if (of_table && other == comparison.table->judged_against && !pair.columns.empty()) {
      return &pair;
    }
  }
  return nullptr;
}

std::string UncertaintyText(const TableUncertainty& uncertainty) {
  if (uncertainty.stated) return "stated in the scenario";
  std::string text;
  for (const auto& [name, value] :
       {std::pair{"digits", uncertainty.digits}, std::pair{"noise", uncertainty.noise},
        std::pair{"time stamps", uncertainty.stamps},
        std::pair{"interpolation", uncertainty.interpolation}}) {
    if (value > 0.0) text += fmt::format("{}{} {:.1e}", text.empty() ? "" : ", ", name, value);
  }
  return text;
}

ReportSection ReferenceTableSection(const Report& report, bool verbose) {
  ReportSection section{.title = "The table in the reference's place", .link = "Table"};
  if (!report.comparison.table) return section;
  const TableVerdict& table = *report.comparison.table;
  section.Add(Paragraph{fmt::format("the reference is the table {}: {}", table.name, table.grid)});
  section.Add(Paragraph{table.too_coarse, Paragraph::Look::kOdd}, On::kPage);
  for (const std::string& diagnosis : table.diagnoses) {
    section.Add(Paragraph{diagnosis, Paragraph::Look::kOdd}, On::kPage);
  }
  if (const PairComparison* pair = TablePair(report.comparison)) {
    section.Add(ColumnTable(table, *pair, verbose));
    section.Note(fmt::format("The tube is {:g} times the column's uncertainty or the scenario's "
                             "limit, whichever is wider.",
                             table.coverage),
                 On::kAll);
    AddPlots(report, *pair, &section);
  }
  Fold notes{"How the file was read", {}};
  if (!table.notes.empty()) notes.blocks.push_back({Items{table.notes}});
  section.Add(std::move(notes), verbose ? On::kAll : On::kPage);
  return section;
}

namespace {

const char* Called(SingularityKind kind) {
  constexpr std::array<const char*, 3> kWords = {"inverse (type 1)", "forward (type 2)",
                                                 "constraint"};
  return kWords.at(static_cast<size_t>(kind));
}

const char* Consequence(SingularityKind kind) {
  constexpr std::array<const char*, 3> kWords = {
      "the mechanism moves while what is commanded rests: the command asks for high speeds",
      "the mechanism moves while the drives rest: drive forces grow",
      "the joints alone lose their hold: reactions grow"};
  return kWords.at(static_cast<size_t>(kind));
}

std::string ForceText(const SingularApproach& approach) {
  if (approach.drive.empty()) return "";
  return fmt::format("{}: {:.3g} {} near, median {:.3g} {}", approach.drive, approach.force_near,
                     approach.unit, approach.force_median, approach.unit);
}

}  // namespace

ReportSection SingularitySection(const Report& report, bool verbose) {
  ReportSection section{.title = "Singular poses", .link = "Singularities"};
  const SingularApproaches& approaches = report.singular;
  if (approaches.of.empty()) return section;
  bool any = verbose;
  Table table{.name = "singularities",
              .caption = "How near the motion comes to singular poses",
              .columns = {Text("kind"), Digits("least distance"), Digits("at"), Digits("median"),
                          Text("moves most"), Spare(Text("largest drive force"))}};
  for (const SingularApproach& approach : approaches.of) {
    const bool warns = approach.asked && approach.close();
    any = any || warns;
    table.rows.push_back(
        {Called(approach.kind),
         Cell(fmt::format("{:.3g}", approach.distance), warns ? Mark::kWarn : Mark::kNone),
         fmt::format("{:.4g} s", approach.time_s), fmt::format("{:.3g}", approach.median),
         approach.body, ForceText(approach)});
  }
  section.Add(std::move(table), any ? On::kAll : On::kPage);
  section.Note(fmt::format(
      "Least speed of coordinates (inverse{}), of the drives (forward), or with which loops "
      "would open (constraint), by that of the bodies: the root mean square over them of the speed "
      "at the middle of a body's joints and its rotation by the characteristic length {:.4g} m. 0 "
      "is singular, below {:g} is close. {} poses were measured.",
      approaches.inverse_of.empty() ? "" : ": " + Joined(approaches.inverse_of),
      approaches.length_m, kCloseToSingular, approaches.poses));
  return section;
}

nlohmann::ordered_json SingularityJson(const Report& report) {
  auto list = nlohmann::ordered_json::array();
  for (const SingularApproach& approach : report.singular.of) {
    nlohmann::ordered_json json = {{"kind", ToText(approach.kind)},
                                   {"distance", Number(approach.distance)},
                                   {"time_s", Number(approach.time_s)},
                                   {"median", Number(approach.median)},
                                   {"close", approach.close()},
                                   {"asked", approach.asked},
                                   {"body", approach.body}};
    if (!approach.drive.empty()) {
      json["force"] = {{"drive", approach.drive},
                       {"unit", approach.unit},
                       {"near", Number(approach.force_near)},
                       {"median", Number(approach.force_median)}};
    }
    list.push_back(std::move(json));
  }
  return {{"length_m", Number(report.singular.length_m)},
          {"close_below", kCloseToSingular},
          {"poses", report.singular.poses},
          {"inverse_of", report.singular.inverse_of},
          {"least", std::move(list)}};
}

std::vector<std::string> SingularityWarnings(const SingularApproaches& approaches) {
  std::vector<std::string> warnings;
  for (const SingularApproach& approach : approaches.of) {
    if (!approach.asked || !approach.close()) continue;
    const std::string forces = ForceText(approach);
    warnings.push_back(fmt::format(
        "close to a singular pose, {}, at t = {:.4g} s: distance {:.2g}, median {:.2g}; {}{}",
        Called(approach.kind), approach.time_s, approach.distance, approach.median,
        Consequence(approach.kind), forces.empty() ? "" : " (" + forces + ")"));
  }
  return warnings;
}

}  // namespace mbv
