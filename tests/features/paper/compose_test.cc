#include "features/paper/figures.h"

#include <gmock/gmock.h>

#include "features/paper/signals.h"
#include "tests/support/read_back.h"

namespace mbv {
namespace {

using testing::ElementsAre;

FigureSpec SpecOf(PanelSpec panel) {
  FigureSpec spec;
  spec.name = {"own", "figures[0].name"};
  spec.caption = "Caption";
  spec.width_mm = 100;
  spec.panels = {std::move(panel)};
  return spec;
}

// Of a run in which the simulation is 0.5 N off on d2 at one sample.
FigureSet Composed(const PanelSpec& panel) {
  synthetic::Case c;
  c.simulated.values(40, c.simulated.Find("d2.force")) += 0.5;
  return ComposeFigures({SpecOf(panel)}, test::SampledReport(c), Language::kEnglish);
}

std::vector<std::string> LabelsOf(const FigurePanel& panel) {
  std::vector<std::string> labels;
  for (const FigureCurve& curve : panel.curves) {
    if (!curve.label.empty()) labels.push_back(curve.label);
  }
  return labels;
}

TEST(ComposeFigures, SeveralSignalsAreLinesOfOneWitnessAndMarkersOfTheOthers) {
  const FigureSet set = Composed({.signals = {{"d*.force"}},
                                  .unit = {"kN"},
                                  .label = "Thrust *F*",
                                  .names = {{"d1.force", "*F*_{1}"}}});
  ASSERT_EQ(set.figures.size(), 1u);
  const Figure& figure = set.figures[0];
  EXPECT_EQ(figure.caption, "Caption");
  EXPECT_EQ(figure.width_mm, 100);
  const FigurePanel& panel = figure.panels[0];
  EXPECT_EQ(panel.y.label, "Thrust *F* (kN)");
  EXPECT_THAT(LabelsOf(panel),
              ElementsAre("*F*_{1}", "d2.force", "analytic", "reference", "simulation"));
  const Trace trace = synthetic::ExactTrace("analytic");
  EXPECT_DOUBLE_EQ(panel.curves[0].points[7].second,
                   1e-3 * trace.values(7, trace.Find("d1.force")));
}

TEST(ComposeFigures, ChangesCountFromTheFirstSample) {
  for (const char* signals : {"d2.force", "d*.force"}) {
    const FigureSet set = Composed(
        {.signals = {{signals}}, .witnesses = {{"analytic"}}, .unit = {"N"}, .from_start = true});
    const Trace trace = synthetic::ExactTrace("analytic");
    const int column = trace.Find(signals == std::string("d2.force") ? signals : "d1.force");
    const FigurePoints& points = set.figures[0].panels[0].curves[0].points;
    EXPECT_EQ(points[0].second, 0.0);
    EXPECT_DOUBLE_EQ(points[7].second, trace.values(7, column) - trace.values(0, column));
  }
}

TEST(ComposeFigures, MarkedWitnessesHaveNoLines) {
  const FigureSet set = Composed({.signals = {{"d2.force"}},
                                  .witnesses = {{"analytic"}, {"simulated"}},
                                  .marks = {{"simulated"}},
                                  .equal_scale = true});
  const FigurePanel& panel = set.figures[0].panels[0];
  EXPECT_TRUE(panel.equal_scale);
  EXPECT_TRUE(panel.curves[0].line);
  EXPECT_EQ(panel.curves[0].marker, -1);
  EXPECT_FALSE(panel.curves[1].line);
  EXPECT_EQ(panel.curves[1].marker, 0);
  EXPECT_EQ(panel.curves[1].points.size(), kMarksAlong);  // of 101 samples
}

TEST(ComposeFigures, OneSignalHasALineForEachWitnessThatIsNamed) {
  const FigureSet set =
      Composed({.signals = {{"d2.force"}}, .witnesses = {{"simulated"}, {"reference"}}});
  const FigurePanel& panel = set.figures[0].panels[0];
  EXPECT_THAT(LabelsOf(panel), ElementsAre("reference", "simulation"));
  EXPECT_NEAR(panel.curves[1].points[40].second - panel.curves[0].points[40].second, 0.5, 1e-12);
  EXPECT_EQ(panel.curves[1].points[41].second, panel.curves[0].points[41].second);
}

TEST(ComposeFigures, DifferencesAreThoseToTheNamedWitness) {
  const FigureSet set = Composed({.signals = {{"d2.force"}}, .against = {"analytic"}, .log = true});
  const FigurePanel& panel = set.figures[0].panels[0];
  EXPECT_TRUE(panel.y.log);
  EXPECT_THAT(LabelsOf(panel), ElementsAre("reference − analytic", "simulation − analytic"));
  EXPECT_NEAR(panel.curves[1].points[40].second, 0.5, 1e-12);
  EXPECT_EQ(panel.curves[0].points[40].second, 0.0);
}

TEST(ComposeFigures, ASignalMayStandOverAnother) {
  const FigureSet set = Composed({.signals = {{"d1.force"}},
                                  .witnesses = {{"analytic"}},
                                  .x = {"d1.position"},
                                  .x_unit = {"mm"},
                                  .x_label = "*q*"});
  const FigurePanel& panel = set.figures[0].panels[0];
  EXPECT_EQ(panel.x.label, "*q* (mm)");
  const Trace trace = synthetic::ExactTrace("analytic");
  EXPECT_DOUBLE_EQ(panel.curves[0].points[9].first,
                   1e3 * trace.values(9, trace.Find("d1.position")));
  EXPECT_DOUBLE_EQ(panel.curves[0].points[9].second, trace.values(9, trace.Find("d1.force")));
}

TEST(ComposeFigures, WhatNoWitnessRecordedIsLeftOutAndReported) {
  const FigureSet set = Composed(
      {.signals = {{"plate.x.velocity", "figures[0].signals"}}, .witnesses = {{"analytic"}}});
  EXPECT_TRUE(set.figures.empty());
  EXPECT_THAT(set.left_out, ElementsAre("own: figures[0].signals = 'plate.x.velocity': no witness "
                                        "that is shown recorded it"));
}

TEST(ComposeFigures, ForcesAtRestAreSolidStrokesFromEndToEnd) {
  synthetic::Case c;
  std::vector<Channel> channels = c.analytic.channels;
  channels.push_back(MakeChannel(Quantity::kForceBand, "N", "d2"));
  Trace resting = c.analytic;
  resting.Reset(c.analytic.time_s, channels);
  resting.values.leftCols(c.analytic.values.cols()) = c.analytic.values;
  resting.values.rightCols(1).setZero();
  resting.values(40, resting.values.cols() - 1) = 3.0;
  c.analytic = resting;
  const FigureSet set = ComposeFigures({SpecOf({.signals = {{"d*.force"}}})},
                                       test::SampledReport(c), Language::kEnglish);
  const FigurePanel& panel = set.figures[0].panels[0];
  const double middle = resting.values(40, resting.Find("d2.force"));
  const FigureCurve& stroke = panel.curves[2];
  ASSERT_EQ(stroke.points.size(), 3u);
  EXPECT_TRUE(stroke.extent);
  EXPECT_EQ(stroke.look, panel.curves[1].look);
  EXPECT_DOUBLE_EQ(stroke.points[0].second, middle - 3.0);
  EXPECT_DOUBLE_EQ(stroke.points[1].second, middle + 3.0);
  // d2 is dashed, its stroke is not.
  const std::string svg = DrawFigure(set.figures[0], FigureStyles()[0], PictureFormat::kSvg);
  size_t solid = 0;
  for (const test::SvgPath& path : test::PathsOf(svg)) {
    const bool upright =
        path.points.size() == 2 && std::abs(path.points[0].first - path.points[1].first) < 1e-9;
    if (upright && path.color == "rgb(83.529412%,36.862745%,0%)") solid += path.dashes.empty();
  }
  EXPECT_EQ(solid, 1u);
}

TEST(ComposeFigures, WithoutALegendNoCurveIsNamed) {
  const FigureSet set = Composed({.signals = {{"d*.force"}}, .legend = false});
  EXPECT_THAT(LabelsOf(set.figures[0].panels[0]), ElementsAre());
}

}  // namespace
}  // namespace mbv
