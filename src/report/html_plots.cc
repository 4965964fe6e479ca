#include "report/html_plots.h"

#include <fmt/format.h>

#include "report/html_text.h"
#include "report/plot_points.h"
#include "report/svg_plot.h"

namespace mbv {
namespace {

// Forces of drives of one unit, and their errors below.
std::string ForcePlotsHtml(const PairComparison& pair, const Trace& measured, const Trace& truth,
                           const SharedAxis& axis) {
  const std::string y_label = fmt::format("[{}]", axis.unit);
  LinePlot forces{.title = fmt::format("Drive forces, {}", pair.measured),
                  .x_label = "time [s]",
                  .y_label = y_label,
                  .lines = {}};
  LinePlot errors{.title = fmt::format("Drive forces, |{} − {}|", pair.measured, pair.truth),
                  .x_label = "time [s]",
                  .y_label = y_label,
                  .log_y = true,
                  .lines = {}};
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
  const PairComparison* pair = MainPair(report.comparison);
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

}  // namespace mbv
