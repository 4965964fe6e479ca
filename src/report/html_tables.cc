#include "report/html_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "report/html_text.h"

namespace mbv {
namespace {

std::string NumberOrDash(double value, const char* format = "{:.2e}") {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "–";
}

std::string At(double time_s) {
  return std::isfinite(time_s) ? fmt::format("{:.4g} s", time_s) : "";
}

// Limit over value as a factor, with a bar of its decimal digits (ten fill it).
std::string Margin(const CheckResult& check) {
  if (!check.limit || !std::isfinite(check.value)) return "";
  if (check.value <= 0.0) return "exact";
  const double digits = std::log10(*check.limit / check.value);
  const double filled = std::clamp(10.0 * std::abs(digits), 2.0, 100.0);
  const std::string factor = digits >= 0.0
                                 ? fmt::format("{:.3g}×", *check.limit / check.value)
                                 : fmt::format("{:.3g}× over", check.value / *check.limit);
  return fmt::format("<span class=\"margin{}\"><i style=\"width:{:.0f}%\"></i></span> {}",
                     check.pass ? "" : " over", filled, factor);
}

std::vector<Cell> CheckRow(const CheckResult& check) {
  const MetricRow& row = RowOf(check.metric);
  const std::string unit = *row.unit == '\0' ? "" : fmt::format(" [{}]", row.unit);
  const std::string pill = !check.limit           ? Pill("off", "off")
                           : !check.pass          ? Pill("fail", "fail")
                           : !check.blind.empty() ? Pill("warn", "verifies nothing")
                           : check.follows        ? Pill("off", "held")
                                                  : Pill("ok", "ok");
  std::string where = check.channel;
  if (!where.empty() && std::isfinite(check.time_s)) where += ", " + At(check.time_s);
  return {Text(Spaced(check.subject)),
          Text(row.title + unit),
          Digits(NumberOrDash(check.value)),
          Digits(check.limit ? fmt::format("{:.1e}", *check.limit) : "off"),
          Markup(pill + (check.floored ? " " + Pill("warn", "floored") : "")),
          Markup(check.blind.empty() ? Margin(check) : ""),
          Text(where)};
}

}  // namespace

std::string FindingsHtml(const Report& report) {
  if (report.findings.empty()) return "";
  std::string html = "<ul class=\"findings\">\n";
  for (const Finding& finding : report.findings.findings()) {
    html += "<li>" + Escape(ToText(finding)) + "</li>\n";
  }
  return html + "</ul>\n";
}

std::string ChecksHtml(const Report& report) {
  if (report.comparison.checks.empty()) return "";
  Table table{.caption = "Checks, failed ones first",
              .head = {Text("of"), Text("quantity"), Digits("value"), Digits("limit"),
                       Text("result"), Text("margin"), Text("worst at")},
              .rows = {}};
  for (const bool failed : {true, false}) {
    for (const CheckResult& check : report.comparison.checks) {
      if ((check.limit && !check.pass) == failed) table.rows.push_back(CheckRow(check));
    }
  }
  return ToHtml(table) +
         Note(
             "The margin is the limit over the value; a full bar is ten decimal digits. Held: a "
             "drive motion compared with itself, which verifies nothing.");
}

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
    html += first ? ToHtml(table)
                  : "<details><summary>" + Escape(table.caption) + "</summary>" + ToHtml(table) +
                        "</details>\n";
  }
  return html;
}

std::string EngineHtml(const Report& report) {
  if (!report.engine_comparison) return "";
  const EngineComparison& engine = *report.engine_comparison;
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
  return ToHtml(table) + failures +
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

std::string NotComparedHtml(const Report& report) {
  std::string html;
  for (const WitnessRecord& record : report.witnesses) {
    if (record.summary.ok()) continue;
    html += "<li><b>" + Escape(record.name) + "</b>: " + Escape(ToText(record.summary.stop)) +
            ". " + Escape(record.summary.message) + "</li>\n";
  }
  for (const NotCompared& item : report.comparison.not_compared) {
    html += "<li><b>" + Escape(item.what) + "</b>: " + Escape(item.why) + "</li>\n";
  }
  return html.empty() ? "" : "<ul>\n" + html + "</ul>\n";
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
         "<details><summary>All rows</summary>" + ToHtml(table) + "</details>\n";
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

std::string ParametersHtml(const Mechanism& mechanism) {
  if (mechanism.parameters.empty()) return "";
  Table table{.caption = "Parameters with the scenario's overrides",
              .head = {Text("name"), Digits("value"), Text("unit"), Text("source"), Text("note")},
              .rows = {}};
  for (const Parameter& parameter : mechanism.parameters) {
    const char* source = parameter.source == Source::kPrinted     ? "printed"
                         : parameter.source == Source::kAssumed   ? "assumed"
                         : parameter.source == Source::kCorrected ? "corrected"
                                                                  : "";
    table.rows.push_back({Text(parameter.name), Digits(fmt::format("{:.10g}", parameter.value)),
                          Text(parameter.unit), Text(source), Text(parameter.note)});
  }
  return "<details><summary>" + fmt::format("{} parameters", mechanism.parameters.size()) +
         "</summary>" + ToHtml(table) + "</details>\n";
}

std::string ReproduceHtml(const HtmlInput& input) {
  const Report& report = *input.report;
  std::string command = "mbverify run " + report.scenario_file;
  for (const std::string& argument : input.arguments) command += " " + argument;
  std::string html = "<pre tabindex=\"0\"><code>" + Escape(command) + "</code></pre>\n";
  Table table{.caption = "Inputs and versions", .head = {Text("what"), Text("is")}, .rows = {}};
  table.rows.push_back({Text("scenario"), Text(report.scenario_file)});
  table.rows.push_back({Text("model"), Text(report.model_file)});
  for (const auto& [name, version] : report.versions) {
    table.rows.push_back({Text(name), Text(version)});
  }
  const Timing& timing = report.timing;
  std::string times = fmt::format("analytic {:.3f} s, reference {:.3f} s, simulation {:.3f} s",
                                  timing.analytic_s, timing.reference_s, timing.simulation_s);
  if (timing.stock_s > 0.0) times += fmt::format(", stock engine {:.3f} s", timing.stock_s);
  if (timing.render_s > 0.0) times += fmt::format(", pictures {:.3f} s", timing.render_s);
  if (timing.loop_s > 0.0 && timing.steps > 0) {
    times += fmt::format("; {} {}, {:.0f}/s", timing.steps,
                         report.mode == "forward" ? "steps" : "samples",
                         static_cast<double>(timing.steps) / timing.loop_s);
  }
  table.rows.push_back({Text("time taken"), Text(times)});
  return html + ToHtml(table) +
         Note(
             "Files beside this page: summary.json (every number), traces.csv (17 digits), "
             "model.xml (the MJCF as simulated).");
}

}  // namespace mbv
