// Errors against the step: every error stands where it was measured, and lines have the fitted
// slope.
#include "features/paper/figures.h"

#include <gmock/gmock.h>

namespace mbv {
namespace {

using testing::HasSubstr;

ConvergenceSeries SeriesOf(Knob knob, double order, bool stock) {
  ConvergenceSeries series;
  series.name = stock ? "stock" : "corrected";
  series.stock = stock;
  series.knob = knob;
  series.extent_m = 1.0;
  for (const double h : {4e-3, 2e-3, 1e-3, 5e-4}) {
    ConvergencePoint point{.step_s = knob == Knob::kTimeConstant ? 1e-3 : h,
                           .time_constant_s = 50.0 * h};
    const double error = 1e-5 * std::pow(h / 4e-3, order);
    point.error = {.smooth = error, .breaks = error};
    series.points.push_back(point);
  }
  Judge(SampleClasses({0.0, 1.0, 2.0}, {}, 0.05), &series);
  return series;
}

ConvergenceReport AConvergence(double order) {
  ConvergenceReport report{.scenario = "case", .mechanism = "robot", .samples = 3};
  report.series = {SeriesOf(Knob::kBoth, order, false), SeriesOf(Knob::kBoth, 1.0, true),
                   SeriesOf(Knob::kTimeConstant, 2.0, false)};
  return report;
}

double SlopeOf(const FigureCurve& line) {
  const auto& [x0, y0] = line.points.front();
  const auto& [x1, y1] = line.points.back();
  return std::log(y1 / y0) / std::log(x1 / x0);
}

TEST(ConvergenceFigures, HaveEveryErrorAndLinesOfTheFittedSlope) {
  const FigureSet set = ConvergenceFigures(AConvergence(4.0), Language::kEnglish);
  ASSERT_EQ(set.figures.size(), 2U);
  EXPECT_EQ(set.figures[0].name, "convergence_step");
  const FigurePanel& panel = set.figures[0].panels.at(0);
  EXPECT_TRUE(panel.x.log && panel.y.log);
  EXPECT_EQ(panel.x.label, "Step *h* (s)");
  ASSERT_EQ(panel.curves.size(), 4U);  // errors and slope of two series
  EXPECT_EQ(panel.curves[0].points.size(), 4U);
  EXPECT_EQ(panel.curves[0].points[1], std::pair(2e-3, 1e-5 / 16));
  EXPECT_FALSE(panel.curves[0].line);
  EXPECT_THAT(panel.curves[0].label, HasSubstr("corrected engine, *p* = 4.00 ("));
  EXPECT_NEAR(SlopeOf(panel.curves[1]), 4.0, 1e-9);
  EXPECT_EQ(panel.curves[1].look, panel.curves[0].look);
  EXPECT_NEAR(SlopeOf(panel.curves[3]), 1.0, 1e-9);
  EXPECT_NE(panel.curves[2].look, panel.curves[0].look);
  const FigurePanel& constant = set.figures[1].panels.at(0);
  EXPECT_EQ(set.figures[1].name, "convergence_time_constant");
  EXPECT_DOUBLE_EQ(constant.curves[0].points[0].first, 0.2);
}

TEST(ConvergenceFigures, APerturbedErrorMovesItsPointAndTheSlope) {
  ConvergenceReport report = AConvergence(4.0);
  report.series[0].points[2].error.smooth *= 1.5;
  Judge(SampleClasses({0.0, 1.0, 2.0}, {}, 0.05), &report.series[0]);
  const FigureSet perturbed = ConvergenceFigures(report, Language::kEnglish);
  const FigurePanel& panel = perturbed.figures[0].panels[0];
  EXPECT_DOUBLE_EQ(panel.curves[0].points[2].second, 1.5e-5 / 256);
  EXPECT_GT(std::abs(SlopeOf(panel.curves[1]) - 4.0), 1e-2);
}

TEST(ConvergenceFigures, SeriesWithoutErrorsAreLeftOutAndSaid) {
  ConvergenceReport report = AConvergence(4.0);
  report.series.resize(1);
  for (ConvergencePoint& point : report.series[0].points) point.error = {};
  const FigureSet set = ConvergenceFigures(report, Language::kEnglish);
  EXPECT_TRUE(set.figures.empty());
  EXPECT_THAT(set.left_out,
              testing::ElementsAre("corrected: fewer than two errors above zero",
                                   "convergence_step: no series has two errors to show",
                                   "convergence_time_constant: no series has two errors to show"));
}

TEST(ConvergenceFigures, SpeakTheLanguage) {
  const FigureSet german = ConvergenceFigures(AConvergence(4.0), Language::kGerman);
  EXPECT_EQ(german.figures[0].panels[0].x.label, "Schrittweite *h* (s)");
  const FigureSet chinese = ConvergenceFigures(AConvergence(4.0), Language::kChinese);
  EXPECT_THAT(chinese.figures[0].panels[0].curves[0].label, HasSubstr("修正引擎"));
}

TEST(FromSection, KeepsPointsAndSaysWordsInTheLanguage) {
  LinePlot plot{.title = "Sections through the z axis",
                .x_label = "distance from the axis [m]",
                .y_label = "z [m]",
                .equal_scale = true,
                .lines = {}};
  plot.lines.push_back({.label = "azimuth 30 deg", .points = {{0, 1}, {2, 3}}, .closed = true});
  const Figure figure = FromSection("workspace_sections", plot, Language::kGerman);
  const FigurePanel& panel = figure.panels.at(0);
  EXPECT_EQ(panel.x.label, "Abstand von der Achse (m)");
  EXPECT_EQ(panel.y.label, "*z* (m)");
  EXPECT_TRUE(panel.equal_scale);
  EXPECT_EQ(panel.curves.at(0).label, "Azimut 30°");
  ASSERT_EQ(panel.curves[0].points.size(), 3U);  // closed
  EXPECT_EQ(panel.curves[0].points[1], std::pair(2.0, 3.0));
  const Figure english = FromSection("s", plot, Language::kEnglish);
  EXPECT_EQ(english.panels[0].x.label, "Distance from the axis (m)");
}

}  // namespace
}  // namespace mbv
