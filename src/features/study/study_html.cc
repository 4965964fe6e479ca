// report.html of a study.

#include "features/study/study_html.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/names.h"
#include "features/study/study_report.h"
#include "plot/style.h"
#include "plot/svg.h"
#include "plot/svg_plot.h"
#include "report/page.h"

namespace mbv {
namespace {

class PlotList {
 public:
  explicit PlotList(const StudyReport& report) : report_(report) {}

  std::vector<StudyPlot> All() {
    for (const QuantitySummary& q : report_.summary.quantities) {
      if (q.sobol) AddIndices(q);
      if (!q.swings.empty()) AddTornado(q);
      if (q.histogram.counts.size() > 1) AddHistogram(q);
    }
    for (const StudyBand& band : report_.bands) {
      if (band.time_s.size() > 1) AddBand(band);
    }
    if (report_.validation) {
      for (const DriveValidation& drive : report_.validation->drives) AddValidation(drive);
    }
    if (!report_.shown.empty()) AddScatter();
    return std::move(plots_);
  }

 private:
  void Add(StudySection section, const std::string& name, std::string svg) {
    std::string file = NearestPlainPath(name);
    std::replace(file.begin(), file.end(), '/', '_');
    const auto taken = [&](const StudyPlot& plot) { return plot.file == file + ".svg"; };
    while (std::any_of(plots_.begin(), plots_.end(), taken)) file += "_";
    plots_.push_back({section, file + ".svg", std::move(svg)});
  }
  void Add(StudySection section, const std::string& name, LinePlot plot) {
    Add(section, name, ToSvg(plot));
    plots_.back().lines = std::move(plot);
  }

  // Its outline, and the nominal value as an upright line.
  void AddHistogram(const QuantitySummary& q) {
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
    Add(StudySection::kHistograms, "histogram_" + q.name, std::move(plot));
  }

  void AddTornado(const QuantitySummary& q) {
    BarPlot bars{
        .title = q.name, .columns = {q.name + ", down, of nominal", "up, of nominal"}, .rows = {}};
    const double scale = std::abs(q.nominal);
    for (const Swing& swing : q.swings) {
      if (!(scale > 0.0) || !std::isfinite(swing.lowest)) continue;
      bars.rows.push_back(
          {report_.study.factors[swing.factor].name,
           {(swing.lowest - q.nominal) / scale, (swing.highest - q.nominal) / scale}});
    }
    if (!bars.rows.empty()) Add(StudySection::kTornado, "tornado_" + q.name, ToSvg(bars));
  }

  void AddIndices(const QuantitySummary& q) {
    BarPlot bars{.title = q.name, .columns = {q.name + ", first order", "total"}, .rows = {}};
    for (size_t k = 0; k < q.sobol->indices.size(); ++k) {
      const SobolIndex& index = q.sobol->indices[k];
      if (!std::isfinite(index.total)) continue;
      const auto interval = [](const Interval& i) { return std::array{i.lower, i.upper}; };
      bars.rows.push_back({report_.study.factors[k].name,
                           {std::max(0.0, index.first), index.total},
                           {interval(index.first_interval), interval(index.total_interval)}});
    }
    if (!bars.rows.empty()) Add(StudySection::kIndices, "indices_" + q.name, ToSvg(bars));
  }

  void AddBand(const StudyBand& band) {
    double largest = 0.0;
    for (const double v : band.upper) largest = std::max(largest, std::abs(v));
    for (const double v : band.lower) largest = std::max(largest, std::abs(v));
    const ShownUnit unit = UsualUnit(band.unit, largest);
    const auto shown = [&](std::vector<double> values) {
      for (double& v : values) v *= unit.factor;
      return values;
    };
    LinePlot plot = ForcePlot(band.drive, unit.name);
    plot.areas.push_back({band.percentiles() ? "5 % … 95 %" : "least … most", band.time_s,
                          shown(band.lower), shown(band.upper)});
    AddLine("nominal", band.time_s, shown(band.nominal), &plot);
    AddLine("median", band.time_s, shown(band.median), &plot);
    plot.lines.back().dashed = true;
    Add(StudySection::kBands, "band_" + band.drive, std::move(plot));
  }

  // E with the band that it should lie in.
  void AddValidation(const DriveValidation& drive) {
    const ForceComparison& f = drive.forces;
    LinePlot plot = ForcePlot(f.drive + ": computed − measured", f.unit);
    PlotArea band{.label = fmt::format("± {:g} u_val", report_.study.validation->coverage),
                  .x = f.time_s,
                  .lower = {},
                  .upper = {}};
    std::vector<double> error;
    for (size_t t = 0; t < f.time_s.size(); ++t) {
      error.push_back(f.computed[t] - f.measured[t]);
      band.upper.push_back(report_.study.validation->coverage * drive.u_val[t]);
      band.lower.push_back(-band.upper.back());
    }
    plot.areas.push_back(std::move(band));
    AddLine("E", f.time_s, error, &plot);
    Add(StudySection::kValidation, "validation_" + f.drive, std::move(plot));
  }

  void AddScatter() {
    constexpr size_t kMostColumns = 8, kMostRows = 6;
    ScatterMatrix matrix;
    matrix.title = "quantities over varied numbers";
    for (const Factor& f : report_.study.factors) {
      if (matrix.columns.size() < kMostColumns) matrix.columns.push_back(f.name);
    }
    for (const StudyQuantity& q : report_.study.quantities) {
      if (matrix.rows.size() < kMostRows) matrix.rows.push_back(q.name);
    }
    for (const PointRow& row : report_.shown) {
      matrix.across.push_back(row.varied);
      matrix.upward.push_back(row.values);
    }
    Add(StudySection::kScatter, "scatter_matrix", ToSvg(matrix));
  }

  static LinePlot ForcePlot(const std::string& title, const std::string& unit) {
    return {.title = title,
            .x_label = "t [s]",
            .y_label = fmt::format("drive force [{}]", unit),
            .lines = {}};
  }

  static void AddLine(const std::string& label, const std::vector<double>& time_s,
                      const std::vector<double>& values, LinePlot* plot) {
    PlotLine line{.label = label, .points = {}};
    for (size_t t = 0; t < values.size(); ++t) line.points.emplace_back(time_s[t], values[t]);
    plot->lines.push_back(std::move(line));
  }

  const StudyReport& report_;
  std::vector<StudyPlot> plots_;
};

}  // namespace

std::vector<StudyPlot> StudyPlots(const StudyReport& report) { return PlotList(report).All(); }

namespace {

const char* FailureWord(const StudyReport& report) {
  return report.summary.within_limits() ? "Not validated" : "Limit violated";
}

}  // namespace

std::string ToHtml(const StudyReport& report) {
  Page page;
  for (const ReportSection& section : SectionsOf(report, StudyPlots(report))) page.Add(section);
  PageHead head{.kicker = "mbverify study", .title = report.study.name};
  head.lead = report.study.description.empty()
                  ? PointsText(report)
                  : report.study.description + "; " + PointsText(report);
  const int code = report.exit_code();
  head.verdict = code == 0 ? Verdict::kAgree : code == 1 ? Verdict::kDisagree : Verdict::kNotRun;
  head.word = code == 3 ? "No result" : code == 1 ? FailureWord(report) : "Limits kept";
  head.judges = code == 3 || report.judged();
  for (const auto& [name, version] : report.versions) {
    head.footer += (head.footer.empty() ? "" : " · ") + name + " " + version;
  }
  return page.Write(head);
}

// A matrix of small plots with a dot per point.

namespace {

constexpr double kCell = 118, kGap = 10, kNames = 150, kTopNames = 26;

PlotAxis AxisOf(const std::vector<std::vector<double>>& points, size_t k, double from, double to) {
  PlotAxis axis{.from_px = from, .to_px = to};
  for (const auto& point : points) axis.Add(point[k]);
  axis.Pad();
  return axis;
}

std::string Panel(const ScatterMatrix& matrix, size_t column, size_t row) {
  const double left = kNames + (kCell + kGap) * static_cast<double>(column);
  const double top = kTopNames + (kCell + kGap) * static_cast<double>(row);
  const PlotAxis x = AxisOf(matrix.across, column, left, left + kCell);
  const PlotAxis y = AxisOf(matrix.upward, row, top + kCell, top);
  std::string dots;  // one path: round line ends without a length
  for (size_t p = 0; p < matrix.across.size(); ++p) {
    const double u = matrix.across[p][column], v = matrix.upward[p][row];
    if (!x.Shows(u) || !y.Shows(v)) continue;
    dots += fmt::format("M{:.1f} {:.1f}h0", x.Px(u), y.Px(v));
  }
  return SvgShape("rect", {{"x", left},
                           {"y", top},
                           {"width", kCell},
                           {"height", kCell},
                           {"fill", "none"},
                           {"stroke", "#888888"}}) +
         SvgShape("path", {{"d", dots},
                           {"fill", "none"},
                           {"stroke", kLineColors[0]},
                           {"stroke-width", "2.4"},
                           {"stroke-linecap", "round"},
                           {"stroke-opacity", "0.6"}}) +
         "\n";
}

}  // namespace

std::string ToSvg(const ScatterMatrix& matrix) {
  std::string svg = "\n" + SvgElement("title", {}, EscapeMarkup(matrix.title)) + "\n";
  for (size_t c = 0; c < matrix.columns.size(); ++c) {
    const double middle = kNames + (kCell + kGap) * static_cast<double>(c) + kCell / 2.0;
    svg += SvgText({{"x", middle}, {"y", "16"}, {"text-anchor", "middle"}},
                   ShortenedName(matrix.columns[c], 18)) +
           "\n";
  }
  for (size_t r = 0; r < matrix.rows.size(); ++r) {
    const double middle = kTopNames + (kCell + kGap) * static_cast<double>(r) + kCell / 2.0;
    svg += SvgText({{"x", kNames - 8}, {"y", middle}, {"text-anchor", "end"}},
                   ShortenedName(matrix.rows[r], 22)) +
           "\n";
    for (size_t c = 0; c < matrix.columns.size(); ++c) svg += Panel(matrix, c, r);
  }
  const double width = kNames + (kCell + kGap) * static_cast<double>(matrix.columns.size());
  const double height = kTopNames + (kCell + kGap) * static_cast<double>(matrix.rows.size());
  return SvgFigure(width, height, matrix.title, svg);
}

}  // namespace mbv
