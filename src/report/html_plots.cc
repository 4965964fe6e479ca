#include "report/html_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "comparison/force_band.h"
#include "comparison/metrics.h"
#include "report/html_text.h"
#include "report/svg_plot.h"

namespace mbv {
namespace {

// More points than a picture this wide can show are thinned; extremes of each bin are kept.
constexpr size_t kBins = 240;

// At common times: a table has fewer rows, a shorter trace ended early.
PlotPoints ErrorOf(const Trace& measured, int column, const Trace& truth, int truth_column) {
  PlotPoints points;
  for (const auto& [i, j] : AlignSamples(measured, truth)) {
    points.emplace_back(measured.time_s[static_cast<size_t>(i)],
                        std::abs(measured.values(i, column) - truth.values(j, truth_column)));
  }
  return points;
}

PlotPoints ValuesOf(const Trace& trace, const ForceSignal& force) {
  PlotPoints points;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    points.emplace_back(trace.time_s[i], force.At(static_cast<Eigen::Index>(i)).middle);
  }
  return points;
}

// A stroke from end to end at every sample whose force friction at rest leaves open.
PlotPoints StrokesOf(const Trace& trace, const ForceSignal& force) {
  PlotPoints points;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const ForceBand at = force.At(static_cast<Eigen::Index>(i));
    if (!at.open()) continue;
    for (const double end : {at.lower(), at.upper(), kNan}) {
      points.emplace_back(trace.time_s[i], end);
    }
  }
  return points;
}

}  // namespace

PlotPoints Thinned(const PlotPoints& points) {
  if (points.size() <= 2 * kBins) return points;
  PlotPoints kept;
  const size_t bin = (points.size() + kBins - 1) / kBins;
  for (size_t from = 0; from < points.size(); from += bin) {
    const auto first = points.begin() + static_cast<std::ptrdiff_t>(from);
    const auto last =
        points.begin() + static_cast<std::ptrdiff_t>(std::min(from + bin, points.size()));
    const auto lower = [](const auto& a, const auto& b) { return a.second < b.second; };
    auto [low, high] = std::minmax_element(first, last, lower);
    if (high < low) std::swap(low, high);
    kept.push_back(*low);
    if (high != low) kept.push_back(*high);
  }
  return kept;
}

std::string StaticPlotsHtml(const Report& report) {
  const PairComparison* pair = MainPair(report.comparison);
  if (pair == nullptr) return "";
  const Trace* measured = TraceOf(report, pair->measured);
  const Trace* truth = TraceOf(report, pair->truth);
  if (measured == nullptr || truth == nullptr) return "";
  std::map<std::string, LinePlot> forces, errors;  // by unit
  for (const std::string& drive : report.drives) {
    const int column = measured->Find(Quantity::kForce, drive);
    const int other = truth->Find(Quantity::kForce, drive);
    if (column < 0 || other < 0) continue;
    const std::string& unit = measured->channels[static_cast<size_t>(column)].unit;
    const auto add = [&](LinePlot* plot, const PlotPoints& points) {
      plot->x_label = "time [s]";
      plot->y_label = fmt::format("[{}]", unit);
      plot->lines.push_back({.label = drive, .points = Thinned(points)});
    };
    const ForceSignal force(*measured, column);
    add(&forces[unit], ValuesOf(*measured, force));
    const PlotPoints strokes = StrokesOf(*measured, force);
    if (!strokes.empty()) {
      forces[unit].lines.push_back({.label = drive + ", at rest", .points = strokes});
    }
    add(&errors[unit], ErrorOf(*measured, column, *truth, other));
  }
  std::string html;
  for (auto& [unit, plot] : forces) {
    plot.title = fmt::format("Drive forces, {}", pair->measured);
    LinePlot& error = errors[unit];
    error.title = fmt::format("Drive forces, |{} − {}|", pair->measured, pair->truth);
    error.log_y = true;
    html += FigureHtml(ToSvg(plot)) + FigureHtml(ToSvg(error));
  }
  return html.empty() ? "" : "<div class=\"static-plots\">\n" + html + "</div>\n";
}

}  // namespace mbv
