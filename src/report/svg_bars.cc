// Horizontal bars.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/svg.h"
#include "report/svg_plot.h"

namespace mbv {
namespace {

constexpr double kBarRow = 20, kBarName = 190, kBarColumn = 230, kBarTop = 24;
constexpr double kBarNumber = 70;  // of a column, for the number behind the longest bar
constexpr std::array<const char*, 2> kBarColors = {"#0072b2", "#d55e00"};

std::string BarLine(const BarRow& row, double top, double scale) {
  std::string svg =
      SvgText({{"x", kBarName - 8}, {"y", top + 13}, {"text-anchor", "end"}}, row.name) + "\n";
  for (size_t c = 0; c < row.shares.size(); ++c) {
    const double left = kBarName + kBarColumn * static_cast<double>(c);
    const double width = std::max(0.5, scale * std::abs(row.shares[c]));
    svg += SvgShape("rect", {{"x", left},
                             {"y", top + 2},
                             {"width", width, 1},
                             {"height", "14"},
                             {"fill", kBarColors[c % kBarColors.size()]}}) +
           SvgText({{"x", left + width + 5, 1}, {"y", top + 13}},
                   fmt::format("{:.2f} %", 100 * row.shares[c])) +
           "\n";
  }
  return svg;
}

}  // namespace

std::string ToSvg(const BarPlot& plot) {
  double most = 1e-12;
  for (const BarRow& row : plot.rows) {
    for (const double share : row.shares) most = std::max(most, std::abs(share));
  }
  std::string svg = "\n";
  for (size_t c = 0; c < plot.columns.size(); ++c) {
    svg += SvgText({{"x", kBarName + kBarColumn * static_cast<double>(c)}, {"y", "14"}},
                   plot.columns[c]);
  }
  svg += "\n";
  double top = kBarTop;
  for (size_t k = 0; k < std::min(plot.shown, plot.rows.size()); ++k) {
    svg += BarLine(plot.rows[k], top, (kBarColumn - kBarNumber) / most);
    top += kBarRow;
  }
  const double width = kBarName + kBarColumn * static_cast<double>(plot.columns.size()) + 20;
  const double height = top + 6;
  return SvgFigure(width, height, plot.title, svg);
}

}  // namespace mbv
