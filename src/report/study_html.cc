// report.html of a study.
#include <fmt/format.h>

#include <cmath>

#include "report/html_text.h"
#include "report/page.h"
#include "report/study_plots.h"
#include "report/study_report.h"
#include "report/study_words.h"

namespace mbv {
namespace {

std::string StudyNumber(double value) { return NumberOrDash(value, "{:.6g}"); }

std::string LimitSection(const StudyReport& report) {
  Table table{
      .caption = "Limits", .head = {Text("limit"), Text("verdict"), Text("points")}, .rows = {}};
  for (const LimitResult& result : report.summary.limits) {
    table.rows.push_back({Text(internal::LimitText(report, result)),
                          Markup(result.pass() ? Pill("ok", "kept") : Pill("fail", "violated")),
                          Text(internal::ShareText(result))});
  }
  if (report.study.witnesses.size() > 1) {
    table.rows.push_back(
        {Text("verdicts by the scenario's checks"),
         Markup(report.summary.disagreed == 0 ? Pill("ok", "kept") : Pill("fail", "violated")),
         Text(internal::DisagreedText(report))});
  }
  if (report.study.missing) {
    const bool kept = report.summary.few_missing();
    table.rows.push_back({Text("points without a result"),
                          Markup(kept ? Pill("ok", "kept") : Pill("fail", "violated")),
                          Text(internal::MissingText(report))});
  }
  if (table.rows.empty()) return "";
  return ToHtml(table) +
         Note(std::string(report.study.missing ? ""
                                               : "Points without a result violate every limit. ") +
              "The interval is Clopper and Pearson's, "
              "as of independent points.");
}

std::string QuantitySection(const StudyReport& report) {
  Table table{.caption = "Quantities over all points", .head = {Text("quantity")}, .rows = {}};
  for (const char* word : {"nominal", "least", "5 %", "median", "95 %", "most", "mean",
                           "standard deviation", "missing"}) {
    table.head.push_back(Digits(word));
  }
  for (const QuantitySummary& q : report.summary.quantities) {
    std::vector<Cell> row = {Text(q.name)};
    for (const double v : {q.nominal, q.least, q.p5, q.p50, q.p95, q.most, q.mean, q.deviation}) {
      row.push_back(Digits(StudyNumber(v)));
    }
    row.push_back(Digits(fmt::format("{}", q.missing)));
    table.rows.push_back(std::move(row));
  }
  return ToHtml(table);
}

std::string Plots(const std::vector<StudyPlot>& plots, StudySection section) {
  std::string html;
  for (const StudyPlot& plot : plots) {
    if (plot.section == section) html += FigureHtml(plot.svg);
  }
  return html;
}

std::string TornadoTables(const StudyReport& report) {
  std::string html;
  for (const QuantitySummary& q : report.summary.quantities) {
    if (q.swings.empty()) continue;
    Table table{.caption = q.name + fmt::format(", nominal {:.6g}", q.nominal),
                .head = {Text("varied alone"), Digits("least"), Digits("most")},
                .rows = {}};
    for (const Swing& swing : q.swings) {
      table.rows.push_back({Text(report.study.factors[swing.factor].name),
                            Digits(StudyNumber(swing.lowest)), Digits(StudyNumber(swing.highest))});
    }
    html += ToHtml(table);
  }
  return html;
}

std::string IndexTables(const StudyReport& report) {
  std::string html;
  const auto interval = [](const Interval& i) {
    return std::isnan(i.lower) ? "–" : fmt::format("{:.3f} … {:.3f}", i.lower, i.upper);
  };
  for (const QuantitySummary& q : report.summary.quantities) {
    if (!q.sobol) continue;
    Table table{.caption = fmt::format("{}: {} blocks, {} left out", q.name, q.sobol->blocks,
                                       q.sobol->left_out),
                .head = {Text("varied"), Digits("first order"), Digits("95 %"), Digits("total"),
                         Digits("95 %")},
                .rows = {}};
    for (size_t k = 0; k < q.sobol->indices.size(); ++k) {
      const SobolIndex& index = q.sobol->indices[k];
      const std::string& name = report.study.factors[k].name;
      table.rows.push_back({Text(name), Digits(NumberOrDash(index.first, "{:.3f}")),
                            Digits(interval(index.first_interval)),
                            Digits(NumberOrDash(index.total, "{:.3f}")),
                            Digits(interval(index.total_interval))});
    }
    html += ToHtml(table);
  }
  if (html.empty()) return "";
  return html + Note(
                    "Shares of the variance: first order of the number alone, total with all that "
                    "it does together with others. Saltelli's and Jansen's estimators; intervals "
                    "by bootstrap of blocks.");
}

std::string BandNote(const StudyReport& report) {
  if (report.bands.empty()) return "";
  return Note(fmt::format("Percentiles at each time of {} points ({} left out).",
                          report.bands[0].points, report.bands[0].left_out));
}

std::string ValidationTable(const StudyReport& report) {
  const StudyValidationResult& validation = *report.validation;
  if (!validation.trouble.empty()) return "<p>" + Escape(validation.trouble) + "</p>\n";
  Table table{.caption = "Drive forces against " + validation.table,
              .head = {Text("drive"), Text("verdict")},
              .rows = {}};
  for (const char* word : {"mean of E", "RMS of E", "u_num", "u_input", "u_D", "u_val",
                           "of RMS measured", "outside"}) {
    table.head.push_back(Digits(word));
  }
  table.head.push_back(Text("largest part"));
  for (const DriveValidation& v : validation.drives) {
    std::vector<Cell> row = {
        Text(fmt::format("{} [{}]", v.forces.drive, v.forces.unit)),
        Markup(v.pass() ? Pill("ok", "within") : Pill("fail", "model error seen"))};
    for (const double x : {v.error_mean, v.error_rms, v.u_num, v.u_input, v.u_data, v.level}) {
      row.push_back(Digits(NumberOrDash(x, "{:.4g}")));
    }
    row.push_back(Digits(fmt::format("{:.2g} %", 100.0 * v.level / v.measured_rms)));
    row.push_back(Digits(fmt::format("{} of {}", v.outside, v.samples())));
    row.push_back(Text(v.largest));
    table.rows.push_back(std::move(row));
  }
  return ToHtml(table) +
         Note(fmt::format(
             "E = computed − measured; standard uncertainties, RMS over the samples: u_num of the "
             "scheme ({}), u_input of the varied numbers, u_D of the table; u_val is their root "
             "sum "
             "of squares, the validation level: a smaller error of the model cannot be seen here. "
             "A "
             "sample is outside where |E| > {:g} u_val; {:g} % of them may be [ASME V&V 20-2009].",
             validation.numerical, report.study.validation->coverage,
             100.0 * report.study.validation->share));
}

std::string ScatterNote(const StudyReport& report) {
  if (report.shown.empty()) return "";
  return Note(fmt::format("{} of {} points; the first 8 varied numbers and 6 quantities.",
                          report.shown.size(), report.summary.points));
}

std::string WorstSection(const StudyReport& report) {
  Table table{.caption = "Worst points",
              .head = {Text("quantity"), Digits("point"), Digits("value"), Text("command")},
              .rows = {}};
  for (size_t k = 0; k < report.summary.quantities.size(); ++k) {
    const QuantitySummary& q = report.summary.quantities[k];
    for (size_t i = 0; i < q.worst.size(); ++i) {
      table.rows.push_back({Text(q.name), Digits(fmt::format("{}", q.worst[i].point)),
                            Digits(StudyNumber(q.worst[i].value)),
                            Markup("<code>" + Escape(report.worst_commands[k][i]) + "</code>")});
    }
  }
  return table.rows.empty() ? "" : ToHtml(table);
}

std::string CommandLines(const std::vector<std::string>& commands) {
  std::string html;
  for (const std::string& command : commands) {
    html += "<p><code>" + Escape(command) + "</code></p>\n";
  }
  return html;
}

std::string DisagreedSection(const StudyReport& report) {
  if (report.summary.disagreed == 0) return "";
  return "<p>" + Escape(internal::DisagreedText(report)) + "</p>\n" +
         CommandLines(report.disagreed_commands);
}

std::string FailureSection(const StudyReport& report) {
  if (report.summary.failed == 0) return "";
  Table table{.caption = "Why points have no result",
              .head = {Text("reason"), Digits("points")},
              .rows = {}};
  for (const auto& [reason, count] : report.summary.reasons) {
    table.rows.push_back({Text(reason), Digits(fmt::format("{}", count))});
  }
  return ToHtml(table) + CommandLines(report.failed_commands);
}

const char* FailureWord(const StudyReport& report) {
  return report.summary.within_limits() ? "Not validated" : "Limit violated";
}

}  // namespace

std::string ToHtml(const StudyReport& report) {
  Page page;
  const std::vector<StudyPlot> plots = StudyPlots(report);
  const auto drawn = [&](StudySection section) { return Plots(plots, section); };
  page.Add("Limits", "Limits", LimitSection(report));
  page.Add("Quantities", "Quantities", QuantitySection(report));
  page.Add("Sobol' indices", "Indices", drawn(StudySection::kIndices) + IndexTables(report));
  page.Add("One number at a time", "Tornado",
           drawn(StudySection::kTornado) + TornadoTables(report));
  if (report.validation) {
    page.Add("Validation", "Validation",
             ValidationTable(report) + drawn(StudySection::kValidation));
  }
  page.Add("Drive forces over time", "Bands", drawn(StudySection::kBands) + BandNote(report));
  page.Add("Distributions", "Histograms", drawn(StudySection::kHistograms));
  page.Add("Point by point", "Scatter", drawn(StudySection::kScatter) + ScatterNote(report));
  page.Add("Worst points, and how to run them", "Worst", WorstSection(report));
  page.Add("Points where witnesses disagree", "Disagreements", DisagreedSection(report));
  page.Add("Points without a result", "Failures", FailureSection(report));
  PageHead head{.kicker = "mbverify study", .title = report.study.name};
  head.lead = report.study.description.empty()
                  ? internal::PointsText(report)
                  : report.study.description + "; " + internal::PointsText(report);
  const int code = report.exit_code();
  head.verdict = code == 0 ? Verdict::kAgree : code == 1 ? Verdict::kDisagree : Verdict::kNotRun;
  head.word = code == 3 ? "No result" : code == 1 ? FailureWord(report) : "Limits kept";
  head.judges = code == 3 || report.judged();
  for (const auto& [name, version] : report.versions) {
    head.footer += (head.footer.empty() ? "" : " · ") + name + " " + version;
  }
  return page.Write(head);
}

}  // namespace mbv
