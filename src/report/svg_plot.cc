#include "report/svg_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/svg.h"
#include "report/html_text.h"
#include "report/plot_axis.h"
#include "report/svg_contours.h"

namespace mbv {
namespace {

constexpr double kWidth = 720, kHeight = 520;
constexpr double kLeft = 84, kRight = 24, kTop = 44, kBottom = 60;
constexpr double kOverlap = 0.3;  // of neighbouring cells, or the ground would shine through
constexpr const char* kGridColor = "#dddddd";

// The whole picture: on white, with a title.
std::string Picture(const std::string& title, const std::string& content, double height = kHeight) {
  return SvgElement(
             "svg",
             {{"xmlns", kSvgNamespace},
              {"viewBox", fmt::format("0 0 {:g} {:g}", kWidth, height)},
              {"width", kWidth},
              {"height", height},
              {"font-family", "sans-serif"},
              {"font-size", "13"},
              {"role", "img"}},
             "\n" + SvgElement("title", {}, Escape(title)) + "\n" +
                 SvgShape("rect", {{"width", "100%"}, {"height", "100%"}, {"fill", "#ffffff"}}) +
                 "\n" + SvgText({{"x", kLeft}, {"y", "26"}, {"font-size", "16"}}, title) + "\n" +
                 content) +
         "\n";
}

std::string Frame(const PlotAxis& x, const PlotAxis& y, const std::string& x_label,
                  const std::string& y_label) {
  const double left = x.from_px, right = x.to_px, top = y.to_px, bottom = y.from_px;
  std::string svg;
  for (double v : x.Ticks()) {
    const double px = x.Px(v);
    svg += SvgShape("line", {{"x1", px, 1},
                             {"x2", px, 1},
                             {"y1", top, 1},
                             {"y2", bottom, 1},
                             {"stroke", kGridColor}}) +
           SvgText({{"x", px, 1}, {"y", bottom + 18, 1}, {"text-anchor", "middle"}},
                   fmt::format("{:g}", v)) +
           "\n";
  }
  for (double v : y.Ticks()) {
    const double px = y.Px(v);
    svg += SvgShape("line", {{"x1", left, 1},
                             {"x2", right, 1},
                             {"y1", px, 1},
                             {"y2", px, 1},
                             {"stroke", kGridColor}}) +
           SvgText({{"x", left - 8, 1}, {"y", px + 4, 1}, {"text-anchor", "end"}},
                   fmt::format("{:g}", v)) +
           "\n";
  }
  const std::string turned = fmt::format("translate(18 {:.1f}) rotate(-90)", 0.5 * (top + bottom));
  return svg +
         SvgShape("rect", {{"x", left, 1},
                           {"y", top, 1},
                           {"width", right - left, 1},
                           {"height", bottom - top, 1},
                           {"fill", "none"},
                           {"stroke", "#444444"}}) +
         "\n" +
         SvgText({{"x", 0.5 * (left + right), 1}, {"y", bottom + 42, 1}, {"text-anchor", "middle"}},
                 x_label) +
         "\n" + SvgText({{"transform", turned}, {"text-anchor", "middle"}}, y_label) + "\n";
}

std::string Curve(const PlotLine& line, const char* color, const PlotAxis& x, const PlotAxis& y) {
  std::string path, dots;
  bool pen_down = false;
  for (const auto& [u, v] : line.points) {
    if (!x.Shows(u) || !y.Shows(v)) {
      pen_down = false;
      continue;
    }
    path += fmt::format("{}{:.2f} {:.2f}", pen_down ? " L" : " M", x.Px(u), y.Px(v));
    if (line.markers) {
      dots += SvgShape("circle",
                       {{"cx", x.Px(u), 2}, {"cy", y.Px(v), 2}, {"r", "3.5"}, {"fill", color}}) +
              "\n";
    }
    pen_down = true;
  }
  if (line.closed && !path.empty()) path += " Z";
  return SvgShape("path",
                  {{"d", path}, {"fill", "none"}, {"stroke", color}, {"stroke-width", "1.8"}}) +
         "\n" + dots;
}

struct LegendEntry {
  std::string label;
  const char* color = nullptr;
};

// Below the axes, in two columns if the labels are short; makes the figure higher.
std::string Legend(const std::vector<LegendEntry>& entries, double* height) {
  constexpr double kRow = 18, kColumn = 312;
  constexpr size_t kShort = 40;  // characters that fit into a column
  const bool two = std::all_of(entries.begin(), entries.end(), [](const LegendEntry& entry) {
    return entry.label.size() <= kShort;
  });
  const size_t columns = two ? 2 : 1;
  std::string svg;
  for (size_t i = 0; i < entries.size(); ++i) {
    const double left = kLeft + kColumn * static_cast<double>(i % columns);
    const double y = kHeight + 4 + kRow * static_cast<double>(i / columns);
    svg += SvgShape("line", {{"x1", left},
                             {"x2", left + 22},
                             {"y1", y - 4},
                             {"y2", y - 4},
                             {"stroke", entries[i].color},
                             {"stroke-width", "2.5"}}) +
           SvgText({{"x", left + 28}, {"y", y}}, entries[i].label) + "\n";
  }
  *height += kRow * static_cast<double>((entries.size() + columns - 1) / columns);
  return svg;
}

std::string MapColorText(double t) {
  const Rgb rgb = MapColor(t);
  return fmt::format("#{:02x}{:02x}{:02x}", rgb[0], rgb[1], rgb[2]);
}

// Equal steps in what the colours show; they run through the middles of the cells.
std::string Contours(const MapPlot& plot, const PlotAxis& x, const PlotAxis& y,
                     const PlotAxis& value) {
  std::vector<double> inner(plot.values.size());
  for (size_t k = 0; k < inner.size(); ++k) {
    inner[k] = value.Shows(plot.values[k]) ? value.Inner(plot.values[k])
                                           : std::numeric_limits<double>::quiet_NaN();
  }
  const double w = (plot.x_max - plot.x_min) / plot.columns;
  const double h = (plot.y_max - plot.y_min) / plot.rows;
  const auto at = [&](const std::array<double, 2>& p) {
    return fmt::format("{:.1f} {:.1f}", x.Px(plot.x_min + (p[0] + 0.5) * w),
                       y.Px(plot.y_min + (p[1] + 0.5) * h));
  };
  std::string path;
  for (int k = 1; k <= plot.contours; ++k) {
    const double level = value.low + k * (value.high - value.low) / (plot.contours + 1);
    for (const ContourPiece& piece : Contour(inner, plot.columns, plot.rows, level)) {
      path += "M" + at(piece.from) + "L" + at(piece.to);
    }
  }
  if (path.empty()) return "";
  return SvgShape("path", {{"d", path},
                           {"fill", "none"},
                           {"stroke", "#ffffff"},
                           {"stroke-width", "1"},
                           {"stroke-opacity", "0.7"}}) +
         "\n";
}

// What the colours stand for, to the right of the map.
std::string ColorBar(const PlotAxis& value, const std::string& label) {
  constexpr int kSteps = 50;
  const double left = kWidth - kRight - 60, cell = (kHeight - kBottom - kTop) / kSteps;
  std::string svg;
  for (int i = 0; i < kSteps; ++i) {
    svg += SvgShape("rect", {{"x", left, 1},
                             {"y", kHeight - kBottom - (i + 1) * cell, 2},
                             {"width", "16"},
                             {"height", cell + kOverlap, 2},
                             {"fill", MapColorText((i + 0.5) / kSteps)}}) +
           "\n";
  }
  for (double v : value.Ticks()) {
    svg += SvgText({{"x", left + 20, 1}, {"y", value.Px(v) + 4, 1}, {"font-size", "11"}},
                   fmt::format("{:g}", v)) +
           "\n";
  }
  return svg +
         SvgText({{"x", kWidth - 8, 1},
                  {"y", kTop - 8, 1},
                  {"font-size", "12"},
                  {"text-anchor", "end"}},
                 label) +
         "\n";
}

}  // namespace

std::string ToSvg(const LinePlot& plot) {
  PlotAxis x{.log = plot.log_x, .from_px = kLeft, .to_px = kWidth - kRight};
  PlotAxis y{.log = plot.log_y, .from_px = kHeight - kBottom, .to_px = kTop};
  for (const PlotLine& line : plot.lines) {
    for (const auto& [u, v] : line.points) {
      if (!x.Shows(u) || !y.Shows(v)) continue;
      x.Add(u);
      y.Add(v);
    }
  }
  x.Pad();
  y.Pad();
  if (plot.equal_scale) EqualScale(&x, &y);
  std::string curves;
  std::vector<LegendEntry> legend;
  for (size_t i = 0; i < plot.lines.size(); ++i) {
    const char* color = kLineColors[i % kLineColors.size()];
    curves += Curve(plot.lines[i], color, x, y);
    if (!plot.lines[i].label.empty()) legend.push_back({plot.lines[i].label, color});
  }
  double height = kHeight;
  const std::string below = Legend(legend, &height);
  return Picture(plot.title, Frame(x, y, plot.x_label, plot.y_label) + curves + below, height);
}

std::string ToSvg(const MapPlot& plot) {
  PlotAxis x{
      .low = plot.x_min, .high = plot.x_max, .from_px = kLeft, .to_px = kWidth - kRight - 90};
  PlotAxis y{.low = plot.y_min, .high = plot.y_max, .from_px = kHeight - kBottom, .to_px = kTop};
  EqualScale(&x, &y);
  PlotAxis value{.log = plot.log_scale, .from_px = kHeight - kBottom, .to_px = kTop};
  for (double v : plot.values) value.Add(v);
  if (!(value.low <= value.high)) value.low = 0, value.high = 1;
  if (value.low == value.high) value.high = value.low + 1;

  std::string cells;
  const double w = std::abs(x.Px(plot.x_max) - x.Px(plot.x_min)) / plot.columns;
  const double h = std::abs(y.Px(plot.y_max) - y.Px(plot.y_min)) / plot.rows;
  for (int r = 0; r < plot.rows; ++r) {
    for (int c = 0; c < plot.columns; ++c) {
      const double v = plot.values[static_cast<size_t>(r) * plot.columns + c];
      if (!value.Shows(v)) continue;
      const double t = (value.Inner(v) - value.low) / (value.high - value.low);
      cells += SvgShape("rect", {{"x", x.Px(plot.x_min) + c * w, 2},
                                 {"y", y.Px(plot.y_min) - (r + 1) * h, 2},
                                 {"width", w + kOverlap, 2},
                                 {"height", h + kOverlap, 2},
                                 {"fill", MapColorText(t)}}) +
               "\n";
    }
  }
  std::string svg = SvgElement("g", {{"shape-rendering", "crispEdges"}}, "\n" + cells) + "\n";
  if (plot.contours > 0) svg += Contours(plot, x, y, value);
  svg += Frame(x, y, plot.x_label, plot.y_label);
  return Picture(plot.title, svg + ColorBar(value, plot.value_label));
}

}  // namespace mbv
