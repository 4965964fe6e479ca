#include "report/html_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/html_text.h"

namespace mbv {
namespace {

std::string At(double time_s) {
  return std::isfinite(time_s) ? fmt::format("{:.4g} s", time_s) : "";
}

}  // namespace

std::string DrivesHtml(const Report& report) {
  std::string html;
  const PairComparison* main = MainPair(report.comparison);
  for (const PairComparison& pair : report.comparison.pairs) {
    if (!pair.compared || pair.drives.empty()) continue;
    Table table{.caption = pair.measured + " against " + pair.truth,
                .head = {Text("drive"), Digits("RMS force"), Digits("RMS error / RMS force"),
                         Digits("largest error"), Digits("at"), Digits("matching digits")},
                .rows = {}};
    for (const DriveMetrics& drive : pair.drives) {
      table.rows.push_back(
          {Text(drive.drive), Digits(fmt::format("{:.6g} {}", drive.rms_truth, drive.unit)),
           Digits(NumberOrDash(drive.nrmse)),
           Digits(NumberOrDash(drive.max_error) + " " + drive.unit), Digits(At(drive.time_s)),
           Cell{NumberOrDash(drive.digits, "{:.1f}") +
                    (drive.floored ? " " + Pill("warn", "floored") : ""),
                true, true}});
    }
    const bool first = &pair == main;
    html += first ? ToHtml(table) : Folded(table.caption, ToHtml(table));
  }
  if (const std::string rest = AtRestText(report.comparison); !rest.empty()) {
    html += Note(Escape(Sentence(rest)) + " Joint reactions are those without the resting force.");
  }
  return html;
}

namespace {

std::string FrictionHtml(const EngineComparison& engine) {
  if (engine.friction.empty()) return "";
  Table table{.caption = "Dry friction by MuJoCo's own frictionloss, against " + engine.truth,
              .head = {Digits("step"), Text("misses farthest"), Digits("by"), Digits("limit")},
              .rows = {}};
  for (const FrictionError& e : engine.friction) {
    const std::string unit = e.unit.empty() ? "" : " " + e.unit;
    table.rows.push_back({Digits(fmt::format("{:g} ms", 1e3 * e.step_s)),
                          Text(e.failure.empty() ? e.check : e.failure),
                          Digits(NumberOrDash(e.value) + unit),
                          Digits(NumberOrDash(e.limit) + unit)});
  }
  return ToHtml(table) + Note(Escape(Sentence(engine.FrictionText())));
}

}  // namespace

std::string EngineHtml(const Report& report) {
  if (!report.engine_comparison) return "";
  const EngineComparison& engine = *report.engine_comparison;
  const std::string friction = FrictionHtml(engine);
  if (engine.engines.empty()) return friction;
  Table table{.caption = "The same run by each engine, against " + engine.truth,
              .head = {Text("engine"), Digits("force error, RMS"),
                       Digits(fmt::format("from {:g} s", engine.later_s)),
                       Digits("force error, largest"), Digits("loop gap")},
              .rows = {}};
  std::string failures;
  for (const EngineError& e : engine.engines) {
    const std::string name = EngineComparison::NameOf(e.engine);
    if (!e.failure.empty()) failures += Note(name + ": no result: " + Escape(e.failure));
    table.rows.push_back(
        {Text(name), Digits(NumberOrDash(e.force_nrmse)), Digits(NumberOrDash(e.force_nrmse_later)),
         Digits(NumberOrDash(e.force_max_rel)), Digits(NumberOrDash(e.closure_max_m) + " m")});
  }
  return friction + ToHtml(table) + failures +
         Note(
             "What MuJoCo as it is is off by is its own modelling error, not the equations'. Most "
             "of it are the first moments, in which its soft constraints take up the load.");
}

// One column per witness that recorded its energies.
std::string EnergyHtml(const Report& report) {
  std::vector<const EnergyAudit*> audits;
  for (const WitnessMetrics& witness : report.comparison.witnesses) {
    if (witness.energy) audits.push_back(&*witness.energy);
  }
  if (audits.empty()) return "";
  Table table{
      .caption = "Energy balance at the end of the run [J]", .head = {Text("of")}, .rows = {}};
  for (const EnergyAudit* audit : audits) table.head.push_back(Digits(audit->witness));
  const auto add = [&](const std::string& title, const auto& value) {
    std::vector<Cell> row = {Text(title)};
    for (const EnergyAudit* audit : audits) row.push_back(Digits(value(*audit)));
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
  Table table{.caption = "Every numbered equation",
              .head = {Text("equation"), Text("status"), Text("as printed"), Text("corrected"),
                       Text("residual"), Text("note")},
              .rows = {}};
  for (const HtmlEquation& row : audit->rows) {
    right += row.right ? 1 : 0;
    corrected += row.corrected_right ? 1 : 0;
    open += row.right || row.corrected_right ? 0 : 1;
    const char* kind = row.right ? "ok" : row.corrected_right ? "warn" : "off";
    table.rows.push_back({Text(row.equation + (row.erratum.empty() ? "" : " " + row.erratum)),
                          Markup(Pill(kind, row.status)), Text(row.printed), Text(row.corrected),
                          Text(row.residual), Text(row.note)});
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
  Table table{.caption = "Frame and sign of each force signal",
              .head = {Text("signal"), Text("unit"), Text("acts on"), Text("exerted by"),
                       Text("frame and axis"), Text("positive means")},
              .rows = {}};
  for (const SignalSheet& sheet : report.sheets) {
    table.rows.push_back({Text(sheet.signal), Text(sheet.unit), Text(sheet.acts_on),
                          Text(sheet.exerted_by), Text(sheet.frame), Text(sheet.positive)});
  }
  return ToHtml(table);
}

std::string TimesText(const Report& report) {
  const Timing& timing = report.timing;
  if (!timing.told) return "";
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

}  // namespace mbv
