#include "plot/svg_plot.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/demand.h"
#include "base/markup.h"
#include "base/text.h"
#include "plot/svg.h"

namespace mbv {
namespace {

constexpr double kRoundOff = 1e-9;  // a smaller relative range is shown as a constant
constexpr int kMostTicks = 16;

// The nearest of 1, 2, 5 and 10 times a power of ten.
double RoundStep(double raw) {
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  return raw / power < 1.5   ? power
         : raw / power < 3.5 ? 2 * power
         : raw / power < 7.5 ? 5 * power
                             : 10 * power;
}

}  // namespace

Rgb MapColor(double t) {
  constexpr std::array<std::array<double, 3>, 5> stops = {
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  const double at = std::clamp(t, 0.0, 1.0) * 4;
  const int k = std::min(3, static_cast<int>(at));
  Rgb rgb{};
  for (size_t c = 0; c < 3; ++c) {
    const double from = stops[static_cast<size_t>(k)][c], to = stops[static_cast<size_t>(k) + 1][c];
    rgb[c] = static_cast<int>(std::lround(from + (at - k) * (to - from)));
  }
  return rgb;
}

Rgb CellColor(const PlotAxis& value, double v) {
  if (!value.Shows(v)) return {-1, -1, -1};
  return MapColor((value.Inner(v) - value.low) / (value.high - value.low));
}

bool PlotAxis::Shows(double v) const { return std::isfinite(v) && (!log || v > 0); }

double PlotAxis::Inner(double v) const { return log ? std::log10(v) : v; }

void PlotAxis::Add(double v) {
  if (!Shows(v)) return;
  low = std::min(low, Inner(v));
  high = std::max(high, Inner(v));
}

void PlotAxis::Pad() {
  if (!(low <= high)) low = 0, high = 1;
  // Round-off of a constant is not a range to show: between its ends ticks would not differ.
  const double largest = std::max(std::abs(low), std::abs(high));
  const bool constant = log ? high <= low : high - low <= kRoundOff * largest;
  const double pad = !constant ? 0.04 * (high - low) : log ? 0.5 : std::max(1e-12, largest);
  low -= pad;
  high += pad;
}

double PlotAxis::Px(double v) const {
  return from_px + (Inner(v) - low) / (high - low) * (to_px - from_px);
}

std::vector<double> PlotAxis::Decades(int wanted) const {
  std::vector<double> ticks;
  const int step = std::max(1, static_cast<int>(std::ceil((high - low) / (wanted + 2))));
  const bool few = high - low < 2.0;
  for (int d = static_cast<int>(std::floor(low)); d <= high; d += step) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = factor * std::pow(10.0, d), inner = Inner(tick);
      if ((factor == 1.0 || few) && inner >= low && inner <= high) ticks.push_back(tick);
    }
  }
  return ticks;
}

std::vector<double> PlotAxis::Ticks(int wanted) const {
  if (log) return Decades(wanted);
  std::vector<double> ticks;
  const double unit = RoundStep((high - low) / wanted), first = std::ceil(low / unit);
  for (int k = 0; k <= kMostTicks && (first + k) * unit <= high; ++k) {
    ticks.push_back((first + k) * unit);
  }
  return ticks;
}

void EqualScale(PlotAxis* x, PlotAxis* y) {
  const double x_px = std::abs(x->to_px - x->from_px), y_px = std::abs(y->to_px - y->from_px);
  const double scale = std::max((x->high - x->low) / x_px, (y->high - y->low) / y_px);
  for (auto [axis, px] : {std::pair{x, x_px}, std::pair{y, y_px}}) {
    const double middle = 0.5 * (axis->low + axis->high);
    axis->low = middle - 0.5 * scale * px;
    axis->high = middle + 0.5 * scale * px;
  }
}

namespace {

constexpr double kWidth = 720, kHeight = 520;
constexpr double kLeft = 84, kRight = 24, kTop = 44, kBottom = 60;
constexpr double kOverlap = 0.3;  // of neighbouring cells, or the ground would shine through
constexpr const char* kGridColor = "#dddddd";
constexpr const char* kAreaColor = "#56b4e9";

// The whole picture: on white, with a title. Pages give what has a class their own colours
// (web/src/report/report.css).
std::string SvgPicture(const std::string& title, const std::string& content,
                       double height = kHeight) {
  return SvgElement("svg",
                    {{"xmlns", kSvgNamespace},
                     {"viewBox", fmt::format("0 0 {:g} {:g}", kWidth, height)},
                     {"width", kWidth},
                     {"height", height},
                     {"class", "chart"},
                     {"font-family", "sans-serif"},
                     {"font-size", "13"},
                     {"role", "img"}},
                    "\n" + SvgElement("title", {}, EscapeMarkup(title)) + "\n" +
                        SvgShape("rect", {{"class", "ground"},
                                          {"width", "100%"},
                                          {"height", "100%"},
                                          {"fill", "#ffffff"}}) +
                        "\n" + SvgText({{"x", kLeft}, {"y", "26"}, {"font-size", "16"}}, title) +
                        "\n" + content) +
         "\n";
}

std::string Frame(const PlotAxis& x, const PlotAxis& y, const std::string& x_label,
                  const std::string& y_label) {
  const double left = x.from_px, right = x.to_px, top = y.to_px, bottom = y.from_px;
  std::string svg;
  for (double v : x.Ticks()) {
    const double px = x.Px(v);
    svg += SvgShape("line", {{"class", "grid"},
                             {"x1", px, 1},
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
    svg += SvgShape("line", {{"class", "grid"},
                             {"x1", left, 1},
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
         SvgShape("rect", {{"class", "frame"},
                           {"x", left, 1},
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
  const SvgAttribute d("d", path), fill("fill", "none"), stroke("stroke", color),
      width("stroke-width", "1.8"), dashes("stroke-dasharray", "6 4");
  return (line.dashed ? SvgShape("path", {d, fill, stroke, width, dashes})
                      : SvgShape("path", {d, fill, stroke, width})) +
         "\n" + dots;
}

// There along the upper curve, back along the lower one.
std::string Area(const PlotArea& area, const PlotAxis& x, const PlotAxis& y) {
  std::string path;
  const size_t n = area.x.size();
  for (size_t i = 0; i < 2 * n; ++i) {
    const bool up = i < n;
    const size_t k = up ? i : 2 * n - 1 - i;
    path += fmt::format("{}{:.2f} {:.2f}", i == 0 ? "M" : " L", x.Px(area.x[k]),
                        y.Px(up ? area.upper[k] : area.lower[k]));
  }
  return SvgShape("path", {{"d", path + " Z"}, {"fill", kAreaColor}, {"fill-opacity", "0.35"}}) +
         "\n";
}

struct LegendEntry {
  std::string label;
  const char* color = nullptr;
  bool dashed = false, area = false;
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
    const size_t row = i / columns;
    const double left = kLeft + kColumn * static_cast<double>(i % columns);
    const double y = kHeight + 4 + kRow * static_cast<double>(row);
    const SvgAttribute x1("x1", left), x2("x2", left + 22), y1("y1", y - 4), y2("y2", y - 4),
        stroke("stroke", entries[i].color), width("stroke-width", entries[i].area ? "9" : "2.5"),
        pale("stroke-opacity", "0.35"), dashes("stroke-dasharray", "6 4");
    svg += (entries[i].area     ? SvgShape("line", {x1, x2, y1, y2, stroke, width, pale})
            : entries[i].dashed ? SvgShape("line", {x1, x2, y1, y2, stroke, width, dashes})
                                : SvgShape("line", {x1, x2, y1, y2, stroke, width})) +
           SvgText({{"x", left + 28}, {"y", y}}, entries[i].label) + "\n";
  }
  const size_t rows = (entries.size() + columns - 1) / columns;
  *height += kRow * static_cast<double>(rows);
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
  for (const PlotArea& area : plot.areas) {
    for (const double u : area.x) x.Add(u);
    for (const double v : area.lower) y.Add(v);
    for (const double v : area.upper) y.Add(v);
  }
  x.Pad();
  y.Pad();
  if (plot.equal_scale) EqualScale(&x, &y);
  std::string curves;
  std::vector<LegendEntry> legend;
  for (const PlotArea& area : plot.areas) {
    curves += Area(area, x, y);
    if (!area.label.empty()) legend.push_back({area.label, kAreaColor, false, true});
  }
  for (size_t i = 0; i < plot.lines.size(); ++i) {
    const char* color = kLineColors[i % kLineColors.size()];
    curves += Curve(plot.lines[i], color, x, y);
    if (!plot.lines[i].label.empty()) {
      legend.push_back({plot.lines[i].label, color, plot.lines[i].dashed});
    }
  }
  double height = kHeight;
  const std::string below = Legend(legend, &height);
  return SvgPicture(plot.title, Frame(x, y, plot.x_label, plot.y_label) + curves + below, height);
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
  return SvgPicture(plot.title, svg + ColorBar(value, plot.value_label));
}

namespace {

// Corners of a square, counter-clockwise from its lower left; edge k joins corners k and k + 1.
constexpr std::array<std::array<int, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};

}  // namespace

std::vector<ContourPiece> Contour(const std::vector<double>& values, int columns, int rows,
                                  double level) {
  MBV_DEMAND(values.size() == static_cast<size_t>(columns) * static_cast<size_t>(rows),
             values.size());
  std::vector<ContourPiece> pieces;
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      std::array<double, 4> v{};
      double mean = 0.0;
      for (size_t k = 0; k < 4; ++k) {
        v[k] = values[static_cast<size_t>(r + kCorners[k][1]) * static_cast<size_t>(columns) +
                      static_cast<size_t>(c + kCorners[k][0])] -
               level;
        mean += v[k] / 4;
      }
      if (!std::isfinite(mean)) continue;
      // Crossings in order around the square: none, two, or four at a saddle.
      std::vector<std::array<double, 2>> crossings;
      for (size_t k = 0; k < 4; ++k) {
        const size_t next = (k + 1) % 4;
        if ((v[k] < 0) == (v[next] < 0)) continue;
        const double t = v[k] / (v[k] - v[next]);
        crossings.push_back({c + kCorners[k][0] + t * (kCorners[next][0] - kCorners[k][0]),
                             r + kCorners[k][1] + t * (kCorners[next][1] - kCorners[k][1])});
      }
      if (crossings.size() == 2) {
        pieces.push_back({crossings[0], crossings[1]});
      } else if (crossings.size() == 4) {
        // The middle belongs to corner 0's side or not: cut off corners 1 and 3, or 0 and 2.
        const size_t first = (mean < 0) == (v[0] < 0) ? 0 : 1;
        pieces.push_back({crossings[first], crossings[first + 1]});
        pieces.push_back({crossings[first + 2], crossings[(first + 3) % 4]});
      }
    }
  }
  return pieces;
}

// Horizontal bars.

namespace {

constexpr double kBarRow = 20, kBarColumn = 230, kBarTop = 24;
constexpr double kLeastName = 190, kMostName = 300;  // room for the rows' names
constexpr double kLetter = 6.6;                      // of a usual letter
constexpr double kBarNumber = 70;  // of a column, for the number behind the longest bar
constexpr std::array<const char*, 2> kBarColors = {"#0072b2", "#d55e00"};

std::string BarLine(const BarRow& row, double top, double scale, double names) {
  std::string svg = SvgText({{"x", names - 8}, {"y", top + 13}, {"text-anchor", "end"}},
                            ShortenedName(row.name, static_cast<size_t>((names - 8) / kLetter))) +
                    "\n";
  for (size_t c = 0; c < row.shares.size(); ++c) {
    const double left = names + kBarColumn * static_cast<double>(c);
    const double width = std::max(0.5, scale * std::abs(row.shares[c]));
    svg += SvgShape("rect", {{"x", left},
                             {"y", top + 2},
                             {"width", width, 1},
                             {"height", "14"},
                             {"fill", kBarColors[c % kBarColors.size()]}});
    double end = width;
    if (!row.intervals.empty() && std::isfinite(row.intervals[c][1])) {
      const auto [low, high] = row.intervals[c];
      const double from = left + scale * std::max(0.0, low), to = left + scale * high;
      svg += SvgShape("path", {{"d", fmt::format("M{0:.1f} {2:g}v8M{0:.1f} {3:g}H{1:.1f}M{1:.1f} "
                                                 "{2:g}v8",
                                                 from, to, top + 5, top + 9)},
                               {"fill", "none"},
                               {"stroke", "currentColor"}});
      end = std::max(end, to - left);
    }
    svg += SvgText({{"x", left + end + 5, 1}, {"y", top + 13}},
                   fmt::format("{:.2f} %", 100 * row.shares[c])) +
           "\n";
  }
  return svg;
}

}  // namespace

std::string ShortenedName(const std::string& name, size_t most) {
  if (PrintedWidth(name) <= most) return name;
  std::string end = name;
  while (PrintedWidth(end) >= most) {
    do end.erase(0, 1);
    while (!end.empty() && (static_cast<unsigned char>(end[0]) & 0xc0) == 0x80);
  }
  return "…" + end;
}

std::string ToSvg(const BarPlot& plot) {
  double most = 1e-12;
  for (const BarRow& row : plot.rows) {
    for (const double share : row.shares) most = std::max(most, std::abs(share));
    for (const auto& [low, high] : row.intervals) {
      if (std::isfinite(high)) most = std::max(most, high);
    }
  }
  size_t longest = 0;
  for (const BarRow& row : plot.rows) longest = std::max(longest, row.name.size());
  const double names =
      std::clamp(std::ceil(kLetter * static_cast<double>(longest)) + 8, kLeastName, kMostName);
  std::string svg = "\n";
  for (size_t c = 0; c < plot.columns.size(); ++c) {
    svg +=
        SvgText({{"x", names + kBarColumn * static_cast<double>(c)}, {"y", "14"}}, plot.columns[c]);
  }
  svg += "\n";
  double top = kBarTop;
  for (size_t k = 0; k < std::min(plot.shown, plot.rows.size()); ++k) {
    svg += BarLine(plot.rows[k], top, (kBarColumn - kBarNumber) / most, names);
    top += kBarRow;
  }
  const double width = names + kBarColumn * static_cast<double>(plot.columns.size()) + 20;
  const double height = top + 6;
  return SvgFigure(width, height, plot.title, svg);
}

}  // namespace mbv
