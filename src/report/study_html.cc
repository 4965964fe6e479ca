// report.html of a study.
#include <fmt/format.h>

#include <cmath>

#include "report/html_text.h"
#include "report/page.h"
#include "report/study_report.h"
#include "report/study_words.h"
#include "report/svg_plot.h"

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
  if (table.rows.empty()) return "";
  return ToHtml(table) +
         Note(
             "Points without a result violate every limit. The interval is Clopper and Pearson's, "
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

// Its outline, and the nominal value as an upright line.
std::string HistogramSvg(const QuantitySummary& q) {
  LinePlot plot{.title = q.name, .x_label = q.name, .y_label = "points", .lines = {}};
  PlotLine outline{.label = "points", .points = {}};
  const auto bins = static_cast<double>(q.histogram.counts.size());
  double most = 0.0;
  outline.points.emplace_back(q.histogram.from, 0.0);
  for (size_t k = 0; k < q.histogram.counts.size(); ++k) {
    const double width = (q.histogram.to - q.histogram.from) / bins;
    const double left = q.histogram.from + width * static_cast<double>(k);
    const auto count = static_cast<double>(q.histogram.counts[k]);
    outline.points.emplace_back(left, count);
    outline.points.emplace_back(left + width, count);
    most = std::max(most, count);
  }
  outline.points.emplace_back(q.histogram.to, 0.0);
  plot.lines.push_back(std::move(outline));
  plot.lines.push_back({.label = "nominal", .points = {{q.nominal, 0.0}, {q.nominal, most}}});
  return ToSvg(plot);
}

std::string HistogramSection(const StudyReport& report) {
  std::string html;
  for (const QuantitySummary& q : report.summary.quantities) {
    if (q.histogram.counts.size() > 1) html += FigureHtml(HistogramSvg(q));
  }
  return html;
}

std::string TornadoSection(const StudyReport& report) {
  std::string html;
  for (const QuantitySummary& q : report.summary.quantities) {
    if (q.swings.empty()) continue;
    BarPlot bars{.title = q.name, .columns = {"down, of nominal", "up, of nominal"}, .rows = {}};
    Table table{.caption = q.name + fmt::format(", nominal {:.6g}", q.nominal),
                .head = {Text("varied alone"), Digits("least"), Digits("most")},
                .rows = {}};
    for (const Swing& swing : q.swings) {
      const std::string& name = report.study.factors[swing.factor].name;
      table.rows.push_back(
          {Text(name), Digits(StudyNumber(swing.lowest)), Digits(StudyNumber(swing.highest))});
      const double scale = std::abs(q.nominal);
      if (!(scale > 0.0) || !std::isfinite(swing.lowest)) continue;
      bars.rows.push_back(
          {name, {(swing.lowest - q.nominal) / scale, (swing.highest - q.nominal) / scale}});
    }
    if (!bars.rows.empty()) html += FigureHtml(ToSvg(bars));
    html += ToHtml(table);
  }
  return html;
}

std::string IndexSection(const StudyReport& report) {
  std::string html;
  const auto interval = [](const Interval& i) {
    return std::isnan(i.lower) ? "–" : fmt::format("{:.3f} … {:.3f}", i.lower, i.upper);
  };
  for (const QuantitySummary& q : report.summary.quantities) {
    if (!q.sobol) continue;
    BarPlot bars{.title = q.name, .columns = {"first order", "total"}, .rows = {}};
    Table table{.caption = fmt::format("{}: {} blocks, {} left out", q.name, q.sobol->blocks,
                                       q.sobol->left_out),
                .head = {Text("varied"), Digits("first order"), Digits("95 %"), Digits("total"),
                         Digits("95 %")},
                .rows = {}};
    for (size_t k = 0; k < q.sobol->indices.size(); ++k) {
      const SobolIndex& index = q.sobol->indices[k];
      const std::string& name = report.study.factors[k].name;
      if (std::isfinite(index.total)) bars.rows.push_back({name, {index.first, index.total}});
      table.rows.push_back({Text(name), Digits(NumberOrDash(index.first, "{:.3f}")),
                            Digits(interval(index.first_interval)),
                            Digits(NumberOrDash(index.total, "{:.3f}")),
                            Digits(interval(index.total_interval))});
    }
    if (!bars.rows.empty()) html += FigureHtml(ToSvg(bars));
    html += ToHtml(table);
  }
  if (html.empty()) return "";
  return html + Note(
                    "Shares of the variance: first order of the number alone, total with all that "
                    "it does together with others. Saltelli's and Jansen's estimators; intervals "
                    "by bootstrap of blocks.");
}

std::string BandSection(const StudyReport& report) {
  std::string html;
  for (const StudyBand& band : report.bands) {
    if (band.time_s.size() < 2) continue;
    LinePlot plot{.title = band.drive,
                  .x_label = "t [s]",
                  .y_label = fmt::format("drive force [{}]", band.unit),
                  .lines = {}};
    const auto add = [&](const char* label, const std::vector<double>& values) {
      PlotLine line{.label = label, .points = {}};
      for (size_t t = 0; t < values.size(); ++t)
        line.points.emplace_back(band.time_s[t], values[t]);
      plot.lines.push_back(std::move(line));
    };
    add("nominal", band.nominal);
    add("5 %", band.p5);
    add("median", band.p50);
    add("95 %", band.p95);
    html += FigureHtml(ToSvg(plot));
  }
  if (html.empty()) return "";
  return html + Note(fmt::format("Percentiles at each time of {} points ({} left out).",
                                 report.bands[0].points, report.bands[0].left_out));
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

std::string FailureSection(const StudyReport& report) {
  if (report.summary.failed == 0) return "";
  Table table{.caption = "Why points have no result",
              .head = {Text("reason"), Digits("points")},
              .rows = {}};
  for (const auto& [reason, count] : report.summary.reasons) {
    table.rows.push_back({Text(reason), Digits(fmt::format("{}", count))});
  }
  std::string html = ToHtml(table);
  for (const std::string& command : report.failed_commands) {
    html += "<p><code>" + Escape(command) + "</code></p>\n";
  }
  return html;
}

}  // namespace

std::string ToHtml(const StudyReport& report) {
  Page page;
  page.Add("Limits", "Limits", LimitSection(report));
  page.Add("Quantities", "Quantities", QuantitySection(report));
  page.Add("Sobol' indices", "Indices", IndexSection(report));
  page.Add("One number at a time", "Tornado", TornadoSection(report));
  page.Add("Drive forces over time", "Bands", BandSection(report));
  page.Add("Distributions", "Histograms", HistogramSection(report));
  page.Add("Worst points, and how to run them", "Worst", WorstSection(report));
  page.Add("Points without a result", "Failures", FailureSection(report));
  PageHead head{.kicker = "mbverify study", .title = report.study.name};
  head.lead = report.study.description.empty()
                  ? internal::PointsText(report)
                  : report.study.description + "; " + internal::PointsText(report);
  const int code = report.exit_code();
  head.verdict = code == 0 ? Verdict::kAgree : code == 1 ? Verdict::kDisagree : Verdict::kNotRun;
  head.word = code == 3 ? "No result" : code == 0 ? "Limits kept" : "Limit violated";
  head.judges = code == 3 || !report.study.limits.empty();
  for (const auto& [name, version] : report.versions) {
    head.footer += (head.footer.empty() ? "" : " · ") + name + " " + version;
  }
  return page.Write(head);
}

}  // namespace mbv
