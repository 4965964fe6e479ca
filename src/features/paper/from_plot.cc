#include "features/paper/from_plot.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "features/paper/signals.h"
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

// The words that a label begins with, in a language.
void Translate(const std::string& words, FigureWord word, Language language, std::string* label) {
  if (label->starts_with(words)) label->replace(0, words.size(), WordFor(word, language));
}

}  // namespace

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

Figure FromSection(const std::string& name, const LinePlot& plot, Language language) {
  Figure figure = FromPlot(name, plot);
  FigurePanel& panel = figure.panels.front();
  for (FigureAxis* axis : {&panel.x, &panel.y}) {
    Translate("distance from the axis", FigureWord::kAxisDistance, language, &axis->label);
  }
  for (FigureCurve& curve : panel.curves) {
    Translate("azimuth", FigureWord::kAzimuth, language, &curve.label);
    if (curve.label.ends_with(" deg")) curve.label.replace(curve.label.size() - 4, 4, "°");
  }
  return figure;
}

Figure FromPlot(const std::string& name, const MapPlot& plot) {
  FigurePanel panel{
      .x = {FigureLabel(plot.x_label)}, .y = {FigureLabel(plot.y_label)}, .map = plot};
  panel.map->value_label = FigureLabel(plot.value_label);
  panel.equal_scale = Parted(plot.x_label).second == Parted(plot.y_label).second;
  return {.name = name, .caption = plot.title, .panels = {std::move(panel)}};
}

namespace {

class ConvergenceFigureMaker {
 public:
  ConvergenceFigureMaker(const ConvergenceReport& report, Language language)
      : report_(report), language_(language) {}

  FigureSet Make() {
    Add("convergence_step", FigureWord::kStep, "*h*", false);
    Add("convergence_time_constant", FigureWord::kTimeConstant, "*t*_{c}", true);
    return std::move(set_);
  }

 private:
  [[nodiscard]] std::string In(FigureWord word) const { return WordFor(word, language_); }

  void Add(const std::string& name, FigureWord against, const char* symbol, bool time_constant) {
    FigurePanel panel{.x = {AxisLabel(In(against), symbol, "s"), true},
                      .y = {AxisLabel(In(FigureWord::kForceError), "", ""), true}};
    for (const ConvergenceSeries& series : report_.series) {
      if ((series.knob == Knob::kTimeConstant) == time_constant) AddSeries(series, &panel);
    }
    if (panel.curves.empty()) {
      set_.left_out.push_back(name + ": no series has two errors to show");
      return;
    }
    set_.figures.push_back(
        {.name = name,
         .caption =
             fmt::format("Error of the drive forces of {} / {} against {}", report_.mechanism,
                         report_.scenario, WordFor(against, Language::kEnglish)),
         .panels = {std::move(panel)}});
  }

  // Markers at the errors, and through those that were fitted a line of the fitted slope.
  void AddSeries(const ConvergenceSeries& series, FigurePanel* panel) {
    const std::vector<double> errors = JudgedErrors(series);
    FigurePoints points;
    for (size_t i = 0; i < errors.size(); ++i) {
      if (errors[i] > 0.0) points.emplace_back(KnobOf(series, series.points[i]), errors[i]);
    }
    if (points.size() < 2) {
      set_.left_out.push_back(series.name + ": fewer than two errors above zero");
      return;
    }
    const int look = series_++;
    panel->curves.push_back({.label = LabelOf(series),
                             .points = points,
                             .look = look,
                             .line = false,
                             .marker = look % kMarkerShapes});
    if (series.fit.first_fitted() < 0) return;
    panel->curves.push_back(
        {.label = "", .points = Slope(series, errors, series.fit.order), .look = look});
    panel->curves.back().extent = true;
  }

  [[nodiscard]] std::string LabelOf(const ConvergenceSeries& series) const {
    std::string label = In(series.stock ? FigureWord::kStockEngine : FigureWord::kCorrectedEngine);
    if (series.knob == Knob::kStep) label += ", " + In(FigureWord::kStepAlone);
    if (series.fit.first_fitted() < 0) return label;
    return label + fmt::format(", *p* = {:.2f} ({})", series.fit.order, ToText(series.expected));
  }

  // C x^order over the fitted points, through their logarithmic mean.
  static FigurePoints Slope(const ConvergenceSeries& series, const std::vector<double>& errors,
                            double order) {
    double log_x = 0.0, log_error = 0.0, count = 0.0;
    for (size_t i = 0; i < errors.size(); ++i) {
      if (!series.fit.fitted[i]) continue;
      log_x += std::log(KnobOf(series, series.points[i]));
      log_error += std::log(errors[i]);
      count += 1.0;
    }
    FigurePoints line;
    for (const int end : {series.fit.first_fitted(), series.fit.last_fitted()}) {
      const double x = KnobOf(series, series.points[static_cast<size_t>(end)]);
      line.emplace_back(x, std::exp(log_error / count + order * (std::log(x) - log_x / count)));
    }
    return line;
  }

  const ConvergenceReport& report_;
  const Language language_;
  int series_ = 0;
  FigureSet set_;
};

}  // namespace

FigureSet ConvergenceFigures(const ConvergenceReport& report, Language language) {
  return ConvergenceFigureMaker(report, language).Make();
}

}  // namespace mbv
