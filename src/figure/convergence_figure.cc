#include "figure/convergence_figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace mbv {
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
