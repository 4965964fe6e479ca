// Plots and labels as other parts of the program describe them, as parts of figures.
#include <algorithm>

#include "plot/layout.h"

namespace mbv {
namespace {

// "x" and "mm" of "x [mm]".
std::pair<std::string, std::string> Parted(const std::string& label) {
  const size_t open = label.rfind(" [");
  if (open == std::string::npos || !label.ends_with(']')) return {label, ""};
  return {label.substr(0, open), label.substr(open + 2, label.size() - open - 3)};
}

// "k_rotation_min" → "*k*_{rotation,min}", "kappa_f" → "*κ*_{f}", "x" → "*x*".
std::string SymbolOf(const std::string& name) {
  const size_t at = name.find('_');
  std::string first = name.substr(0, at);
  if (first == "kappa") first = "κ";
  if (at == std::string::npos) return "*" + first + "*";
  std::string rest = name.substr(at + 1);
  std::ranges::replace(rest, '_', ',');
  return "*" + first + "*_{" + rest + "}";
}

std::string UnitInPrint(std::string unit) {
  if (unit == "mixed") return "";
  if (unit == "deg") return "°";
  for (size_t at = unit.find(' '); at != std::string::npos; at = unit.find(' ', at)) {
    unit.replace(at, 1, "·");
  }
  const size_t power = unit.find('^');
  return power == std::string::npos ? unit
                                    : unit.substr(0, power) + "^{" + unit.substr(power + 1) + "}";
}

}  // namespace

std::string AxisLabel(const std::string& name, const std::string& symbol, const std::string& unit) {
  std::string label = name;
  if (!symbol.empty()) label += (label.empty() ? "" : " ") + symbol;
  return unit.empty() || unit == "1" ? label : label + " (" + unit + ")";
}

std::string FigureLabel(const std::string& label) {
  const auto [name, unit] = Parted(label);
  const bool symbol = name.size() == 1 || name.find('_') != std::string::npos;
  return AxisLabel(symbol ? "" : AsPlainText(name), symbol ? SymbolOf(name) : "",
                   UnitInPrint(unit));
}

Figure FromPlot(const std::string& name, const LinePlot& plot) {
  FigurePanel panel{.x = {FigureLabel(plot.x_label), plot.log_x},
                    .y = {FigureLabel(plot.y_label), plot.log_y},
                    .equal_scale = plot.equal_scale};
  for (const PlotLine& line : plot.lines) {
    FigureCurve curve{.label = AsPlainText(line.label),
                      .points = line.points,
                      .look = static_cast<int>(panel.curves.size()),
                      .marker = line.markers ? 0 : -1};
    if (line.closed && !curve.points.empty()) curve.points.push_back(curve.points.front());
    panel.curves.push_back(std::move(curve));
  }
  return {.name = name, .caption = plot.title, .panels = {std::move(panel)}};
}

Figure FromPlot(const std::string& name, const MapPlot& plot) {
  FigurePanel panel{
      .x = {FigureLabel(plot.x_label)}, .y = {FigureLabel(plot.y_label)}, .map = plot};
  panel.map->value_label = FigureLabel(plot.value_label);
  panel.equal_scale = Parted(plot.x_label).second == Parted(plot.y_label).second;
  return {.name = name, .caption = plot.title, .panels = {std::move(panel)}};
}

}  // namespace mbv
