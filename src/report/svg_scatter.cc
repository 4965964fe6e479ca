// A matrix of small plots with a dot per point.
#include <fmt/format.h>

#include <algorithm>

#include "core/svg.h"
#include "report/plot_axis.h"
#include "report/study_plots.h"

namespace mbv {
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

// As much of a name as the margin has room for.
std::string Cut(const std::string& name, size_t most) {
  return name.size() <= most ? name : "…" + name.substr(name.size() - most + 1);
}

}  // namespace

std::string ToSvg(const ScatterMatrix& matrix) {
  std::string svg = "\n" + SvgElement("title", {}, EscapeMarkup(matrix.title)) + "\n";
  for (size_t c = 0; c < matrix.columns.size(); ++c) {
    const double middle = kNames + (kCell + kGap) * static_cast<double>(c) + kCell / 2.0;
    svg += SvgText({{"x", middle}, {"y", "16"}, {"text-anchor", "middle"}},
                   Cut(matrix.columns[c], 18)) +
           "\n";
  }
  for (size_t r = 0; r < matrix.rows.size(); ++r) {
    const double middle = kTopNames + (kCell + kGap) * static_cast<double>(r) + kCell / 2.0;
    svg += SvgText({{"x", kNames - 8}, {"y", middle}, {"text-anchor", "end"}},
                   Cut(matrix.rows[r], 22)) +
           "\n";
    for (size_t c = 0; c < matrix.columns.size(); ++c) svg += Panel(matrix, c, r);
  }
  const double width = kNames + (kCell + kGap) * static_cast<double>(matrix.columns.size());
  const double height = kTopNames + (kCell + kGap) * static_cast<double>(matrix.rows.size());
  return SvgFigure(width, height, matrix.title, svg);
}

}  // namespace mbv
