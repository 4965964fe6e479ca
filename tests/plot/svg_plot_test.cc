#include "plot/svg_plot.h"

#include <fmt/format.h>
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

// The plot is 84 … 696 px wide and 44 … 460 px high, with 4 % of the range around the points.
TEST(SvgPlot, PointsStandWhereTheAxesSay) {
  LinePlot plot{.title = "t",
                .x_label = "x [m]",
                .y_label = "y [N]",
                .lines = {{.label = "", .points = {{0, 0}, {100, 50}}, .markers = true}}};
  const std::string svg = ToSvg(plot);
  const double x = 84 + 612 * 4.0 / 108.0, y = 460 - 416 * 2.0 / 54.0;
  EXPECT_NE(svg.find(fmt::format("d=\" M{:.2f} {:.2f} L{:.2f} {:.2f}\"", x, y, 780 - x, 504 - y)),
            std::string::npos)
      << svg;
  EXPECT_NE(svg.find(fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\"", 780 - x, 504 - y)),
            std::string::npos);
  const auto tick = [](double v) { return 84 + 612 * (v + 4.0) / 108.0; };
  EXPECT_NE(svg.find(fmt::format("<text x=\"{:.1f}\" y=\"478.0\" text-anchor=\"middle\">20</text>",
                                 tick(20))),
            std::string::npos)
      << svg;
  EXPECT_NE(svg.find("y=\"502.0\" text-anchor=\"middle\">x [m]</text>"), std::string::npos);
  EXPECT_NE(svg.find("rotate(-90)\" text-anchor=\"middle\">y [N]</text>"), std::string::npos);
  plot.log_x = true;
  plot.lines[0].points = {{1, 0}, {10, 25}, {100, 50}};
  EXPECT_NE(ToSvg(plot).find(" L390.00 252.00"), std::string::npos) << "a decade is half the way";
}

TEST(SvgPlot, EqualScalesMakeACircleRound) {
  LinePlot plot{.title = "", .x_label = "", .y_label = "", .equal_scale = true, .lines = {}};
  plot.lines.push_back(
      {.label = "", .points = {{-1, 0}, {1, 0}, {0, 1}, {0, -1}}, .markers = true});
  const std::string svg = ToSvg(plot);
  const double radius = 0.5 * 416 / 1.08;
  EXPECT_NE(svg.find(fmt::format("cx=\"{:.2f}\" cy=\"252.00\"", 390 + radius)), std::string::npos);
  EXPECT_NE(svg.find(fmt::format("cx=\"390.00\" cy=\"{:.2f}\"", 252 - radius)), std::string::npos);
}

TEST(SvgPlot, BarsAreAsLongAsTheirShares) {
  const BarPlot plot{.title = "who <is> it",
                     .columns = {"force", "moment"},
                     .rows = {{"a & b", {0.5, -0.25}}, {"c", {0.0, 0.125}}, {"d", {1.0, 0.0}}},
                     .shown = 2};
  EXPECT_EQ(ToSvg(plot),
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 670 70\" width=\"670\" "
            "height=\"70\" style=\"max-width:100%;height:auto\" font-size=\"12\" "
            "fill=\"currentColor\" role=\"img\" aria-label=\"who &lt;is&gt; it\">\n"
            "<text x=\"190\" y=\"14\">force</text><text x=\"420\" y=\"14\">moment</text>\n"
            "<text x=\"182\" y=\"37\" text-anchor=\"end\">a &amp; b</text>\n"
            "<rect x=\"190\" y=\"26\" width=\"80.0\" height=\"14\" fill=\"#0072b2\"/>"
            "<text x=\"275.0\" y=\"37\">50.00 %</text>\n"
            "<rect x=\"420\" y=\"26\" width=\"40.0\" height=\"14\" fill=\"#d55e00\"/>"
            "<text x=\"465.0\" y=\"37\">-25.00 %</text>\n"
            "<text x=\"182\" y=\"57\" text-anchor=\"end\">c</text>\n"
            "<rect x=\"190\" y=\"46\" width=\"0.5\" height=\"14\" fill=\"#0072b2\"/>"
            "<text x=\"195.5\" y=\"57\">0.00 %</text>\n"
            "<rect x=\"420\" y=\"46\" width=\"20.0\" height=\"14\" fill=\"#d55e00\"/>"
            "<text x=\"445.0\" y=\"57\">12.50 %</text>\n"
            "</svg>\n");
}

TEST(SvgPlot, AnAreaLiesBetweenItsCurvesAndItsRangeCounts) {
  LinePlot plot{.title = "t", .x_label = "x", .y_label = "y", .lines = {}};
  plot.lines.push_back({.label = "m", .points = {{0, 1}, {1, 1}}, .dashed = true});
  plot.areas.push_back({"band", {0, 1}, {0, 0.5}, {2, 1.5}});
  const std::string svg = ToSvg(plot);
  // 0 … 2 with 4 % at both ends on 416 px above y = 460; 0 … 1 likewise on 612 px from x = 84.
  const auto at = [](double x, double y) {
    return fmt::format("{:.2f} {:.2f}", 84 + (x + 0.04) / 1.08 * 612,
                       460 - (y + 0.08) / 2.16 * 416);
  };
  EXPECT_NE(
      svg.find(fmt::format("d=\"M{} L{} L{} L{} Z\"", at(0, 2), at(1, 1.5), at(1, 0.5), at(0, 0))),
      std::string::npos)
      << svg;
  EXPECT_LT(svg.find("fill-opacity"), svg.find("stroke-dasharray")) << "lines above the area";
  EXPECT_NE(svg.find(">band</text>"), std::string::npos);
}

TEST(SvgPlot, LongNamesOfBarsHaveRoomOrLoseTheirBeginning) {
  const auto with = [](size_t letters) {
    return ToSvg(
        BarPlot{.title = "n", .columns = {"c"}, .rows = {{std::string(letters, 'a'), {1.0}}}});
  };
  EXPECT_NE(with(30).find("<rect x=\"206\""), std::string::npos) << with(30);
  EXPECT_NE(with(30).find(">" + std::string(30, 'a') + "<"), std::string::npos);
  EXPECT_NE(with(60).find(">…" + std::string(43, 'a') + "<"), std::string::npos) << with(60);
}

TEST(SvgPlot, IntervalsOfBarsEndWhereTheirNumbersDo) {
  const BarPlot plot{.title = "i",
                     .columns = {"first"},
                     .rows = {{"a", {0.5}, {{0.25, 1.0}}}, {"b", {0.25}, {{-0.5, 0.5}}}}};
  const std::string svg = ToSvg(plot);
  // 1.0, the largest end, is 160 px long; nothing is left of the axis at 190.
  EXPECT_NE(svg.find("d=\"M230.0 29v8M230.0 33H350.0M350.0 29v8\""), std::string::npos) << svg;
  EXPECT_NE(svg.find("d=\"M190.0 49v8M190.0 53H270.0M270.0 49v8\""), std::string::npos) << svg;
}

TEST(SvgPlot, ContoursRunBetweenTheMiddlesOfCells) {
  MapPlot plot{.title = "m",
               .x_label = "x",
               .y_label = "y",
               .value_label = "v",
               .columns = 2,
               .rows = 1,
               .values = {0.0, 1.0}};
  EXPECT_EQ(ToSvg(plot).find("stroke-opacity"), std::string::npos);
  // One level, 0.5, half way between the columns: x = 0.5 of an axis 84 … 606 px wide and as high.
  plot.rows = 2;
  plot.values = {0.0, 1.0, 0.0, 1.0};
  plot.contours = 1;
  const std::string svg = ToSvg(plot);
  EXPECT_NE(svg.find("<path d=\"M345.0 356.0L345.0 148.0\""), std::string::npos) << svg;
}

}  // namespace
}  // namespace mbv
