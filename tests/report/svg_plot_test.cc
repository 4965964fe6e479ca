#include "report/svg_plot.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

size_t Count(const std::string& text, const std::string& word) {
  size_t count = 0;
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

TEST(SvgPlot, EachLineIsOnePathAndMarkersAreDots) {
  const LinePlot plot{.title = "a < b & c",
                      .x_label = "x [m]",
                      .y_label = "y [m]",
                      .lines = {{.label = "one", .points = {{0, 0}, {1, 1}}, .markers = true},
                                {.label = "two", .points = {{0, 1}, {1, 0}}}}};
  const std::string svg = ToSvg(plot);
  EXPECT_EQ(Count(svg, "<path"), 2u);
  EXPECT_EQ(Count(svg, "<circle"), 2u);
  EXPECT_NE(svg.find("a &lt; b &amp; c"), std::string::npos);
}

TEST(SvgPlot, TheLegendStandsBelowTheAxesAndHidesNoCurve) {
  LinePlot plot{.title = "t", .x_label = "x", .y_label = "y", .lines = {}};
  const std::string bare = ToSvg(plot);
  EXPECT_NE(bare.find("height=\"520\""), std::string::npos);
  for (int i = 0; i < 3; ++i) plot.lines.push_back({.label = "line", .points = {{0, i}, {1, i}}});
  EXPECT_NE(ToSvg(plot).find("height=\"556\""), std::string::npos);  // two rows of two
  plot.lines[0].label = "a label that is too long for half of the width";
  EXPECT_NE(ToSvg(plot).find("height=\"574\""), std::string::npos);  // three rows
}

TEST(SvgPlot, FewDecadesHaveTicksBetween) {
  LinePlot plot{.title = "t", .x_label = "x", .y_label = "y", .log_x = true, .lines = {}};
  plot.lines.push_back({.label = "", .points = {{2.5e-4, 0}, {4e-3, 1}}});
  for (const char* tick : {">0.0005<", ">0.001<", ">0.002<"}) {
    EXPECT_NE(ToSvg(plot).find(tick), std::string::npos) << tick;
  }
  plot.lines[0].points = {{1e-6, 0}, {1, 1}};
  EXPECT_EQ(ToSvg(plot).find(">2e-05<"), std::string::npos);
}

TEST(SvgPlot, MissingAndNonPositiveValuesBreakALogarithmicLine) {
  const LinePlot plot{.title = "t",
                      .x_label = "x",
                      .y_label = "y",
                      .log_y = true,
                      .lines = {{.label = "", .points = {{0, 1}, {1, NAN}, {2, 0}, {3, 10}}}}};
  const std::string svg = ToSvg(plot);
  EXPECT_EQ(Count(svg, " M"), 2u);  // two single points, no stroke between them
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(SvgPlot, RoundOffOfAConstantIsDrawnAsAConstant) {
  // One unit in the last place between the ends: ticks of that range would never end.
  const double next = std::nextafter(0.6, 1.0);
  const LinePlot plot{.title = "t",
                      .x_label = "x",
                      .y_label = "y",
                      .lines = {{.label = "", .points = {{0, 0.6}, {1, next}, {2, 0.6}}}}};
  const std::string svg = ToSvg(plot);
  EXPECT_LT(Count(svg, "<line"), 40u);
  EXPECT_GE(Count(svg, "<line"), 4u);
}

TEST(SvgPlot, AMapLeavesMissingCellsBlankAndEndsInItsTwoColours) {
  const MapPlot plot{.title = "m",
                     .x_label = "x",
                     .y_label = "y",
                     .value_label = "v",
                     .columns = 2,
                     .rows = 2,
                     .values = {1.0, 2.0, NAN, 3.0}};
  const std::string svg = ToSvg(plot);
  // Background, frame, three cells and fifty cells of the colour bar.
  EXPECT_EQ(Count(svg, "<rect"), 1u + 1u + 3u + 50u);
  EXPECT_NE(svg.find("#440154"), std::string::npos);
  EXPECT_NE(svg.find("#fde725"), std::string::npos);
}

}  // namespace
}  // namespace mbv
