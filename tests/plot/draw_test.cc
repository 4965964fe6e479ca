#include "plot/draw.h"

#include <gmock/gmock.h>

#include <set>

#include "base/png.h"
#include "plot/layout.h"
#include "tests/support/read_back.h"

namespace mbv {
namespace {

using test::PathsOf;
using test::SvgPath;
using test::TextsOf;

Figure TwoPanels() {
  Figure figure{.name = "two", .common_x = true};
  FigurePanel upper{.x = {.label = "Time *t* (s)"}, .y = {.label = "Force *F* (N)"}};
  upper.curves = {{.label = "first", .points = {{0, 1}, {1, 4}, {2, 2}}, .look = 0},
                  {.label = "second", .points = {{0, 3}, {1, 5}, {2, kNan}}, .look = 1},
                  {.label = "marks", .points = {{0.5, 2}}, .look = 2, .line = false, .marker = 1}};
  FigurePanel lower{.x = {.label = "Time *t* (s)"}, .y = {.label = "Error (N)", .log = true}};
  lower.curves = {{.label = "error", .points = {{0, 1e-9}, {1, 1e-6}, {2, 0}}, .look = 0}};
  figure.panels = {upper, lower};
  return figure;
}

// The path that is drawn for a curve: where the layout puts its points.
FigurePoints PlacedPoints(const Figure& figure, size_t panel, size_t curve) {
  const FigureLayout layout = LayOut(figure, FigureStyles()[0]);
  const PanelPlace& place = layout.panels[panel];
  FigurePoints points;
  for (const auto& [x, y] : figure.panels[panel].curves[curve].points) {
    if (place.x.Shows(x) && place.y.Shows(y)) points.emplace_back(place.x.Px(x), place.y.Px(y));
  }
  return points;
}

// Cairo's coordinates have 8 binary places.
constexpr double kCairoStep = 1.0 / 256;

bool IsDrawn(const FigurePoints& wanted, const std::string& svg) {
  for (const SvgPath& path : PathsOf(svg)) {
    bool same = path.points.size() == wanted.size();
    for (size_t k = 0; same && k < wanted.size(); ++k) {
      same = std::abs(path.points[k].first - wanted[k].first) <= kCairoStep &&
             std::abs(path.points[k].second - wanted[k].second) <= kCairoStep;
    }
    if (same) return true;
  }
  return false;
}

TEST(DrawFigure, CurvesGoThroughTheirPoints) {
  const Figure figure = TwoPanels();
  const std::string svg = DrawFigure(figure, FigureStyles()[0], PictureFormat::kSvg);
  for (const auto& [panel, curve] : {std::pair<size_t, size_t>{0, 0}, {0, 1}, {1, 0}}) {
    EXPECT_TRUE(IsDrawn(PlacedPoints(figure, panel, curve), svg)) << panel << curve;
  }
}

TEST(DrawFigure, OnePerturbedPointIsSeen) {
  Figure figure = TwoPanels();
  const FigurePoints straight = PlacedPoints(figure, 0, 0);
  figure.panels[0].curves[0].points[2].second += 0.05;  // of a range of 4
  EXPECT_FALSE(IsDrawn(straight, DrawFigure(figure, FigureStyles()[0], PictureFormat::kSvg)));
}

TEST(DrawFigure, APointBetweenGapsIsADot) {
  Figure figure = TwoPanels();
  const std::string line = DrawFigure(figure, FigureStyles()[0], PictureFormat::kSvg);
  figure.panels[1].curves[0].points = {{0, 1e-9}, {1, 0}, {2, 1e-6}};
  const std::string dots = DrawFigure(figure, FigureStyles()[0], PictureFormat::kSvg);
  const auto filled = [](const std::string& svg) {
    size_t count = 0;
    for (size_t at = 0; (at = svg.find("fill:rgb(0%,44", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  EXPECT_EQ(filled(line), 0u);
  EXPECT_EQ(filled(dots), 2u);
}

TEST(DrawFigure, CurvesAreReportedApartInGrey) {
  const FigureStyle style = FigureStyles()[0];
  Figure figure = TwoPanels();
  figure.panels.resize(1);
  figure.panels[0].curves.clear();
  for (int k = 0; k < 8; ++k) {
    figure.panels[0].curves.push_back({.points = {{0, k}, {1, k + 1}}, .look = k});
  }
  std::set<std::string> dashes, colors;
  for (const SvgPath& path : PathsOf(DrawFigure(figure, style, PictureFormat::kSvg))) {
    const bool tick = path.points.size() != 2 || path.color == "rgb(0%,0%,0%)";
    if (!tick || !path.dashes.empty()) dashes.insert(path.dashes);
    colors.insert(path.color);
  }
  EXPECT_EQ(dashes.size(), 8u);
  EXPECT_EQ(colors.size(), 8u);
  const std::set<std::vector<double>> patterns(style.dashes.begin(), style.dashes.end());
  EXPECT_EQ(patterns.size(), 8u);
}

TEST(DrawFigure, PdfHasTheTextsAndTheColumnsWidth) {
  const test::TestFolder folder("width");
  const std::string pdf = DrawFigure(TwoPanels(), FigureStyles()[0], PictureFormat::kPdf);
  const std::string texts = TextsOf(pdf);
  for (const char* text : {"Time t (s)", "Force F (N)", "first", "second", "marks", "10−7"}) {
    EXPECT_NE(texts.find(text), std::string::npos) << text << "\n" << texts;
  }
  const std::string info = test::OutputOf("pdfinfo '" + folder.Write("a.pdf", pdf) + "'");
  EXPECT_NE(info.find("Page size:       252 x "), std::string::npos) << info;  // 3.5 in
  EXPECT_EQ(info.find("CreationDate"), std::string::npos) << info;
}

TEST(DrawFigure, TheSameFigureGivesTheSameBytes) {
  for (const PictureFormat format :
       {PictureFormat::kPdf, PictureFormat::kSvg, PictureFormat::kPng}) {
    Figure figure = TwoPanels();
    figure.panels[1].map.emplace();
    figure.panels[1].map->columns = 2;
    figure.panels[1].map->rows = 1;
    figure.panels[1].map->values = {1, 2};
    const std::string first = DrawFigure(figure, FigureStyles()[0], format);
    EXPECT_EQ(first, DrawFigure(figure, FigureStyles()[0], format));
    figure.panels[0].curves[0].points[0].second = 1.5;
    EXPECT_NE(first, DrawFigure(figure, FigureStyles()[0], format));
  }
}

TEST(DrawFigure, PngHasTheResolutionOfTheStyle) {
  FigureStyle style = FigureStyles()[0];
  style.dpi = 100;
  Picture picture;
  ASSERT_TRUE(DecodePng(DrawFigure(TwoPanels(), style, PictureFormat::kPng), 1000000, &picture));
  EXPECT_EQ(picture.width, 350);
}

TEST(FigureLayout, NothingOverlaps) {
  Figure figure = TwoPanels();
  figure.panels[0].curves[0].label = "a rather long name of a curve, longer than half a column";
  for (const FigureStyle& style : FigureStyles()) {
    const FigureLayout layout = LayOut(figure, style);
    double below = 0;
    for (size_t k = 0; k < 2; ++k) {
      const PanelPlace& panel = layout.panels[k];
      const size_t lines = (LegendOf(figure.panels[k]).size() - 1) / panel.legend_columns + 1;
      const auto rows = static_cast<double>(lines);
      EXPECT_GE(panel.legend_top, below);
      EXPECT_GE(panel.top, panel.legend_top + rows * layout.row);
      EXPECT_GT(panel.left, layout.tick_room + layout.row);
      below = panel.top + panel.height;
    }
    EXPECT_GE(layout.height, below + 2 * layout.row);
    EXPECT_EQ(layout.panels[0].x.low, layout.panels[1].x.low);
  }
}

TEST(FigureLayout, AStatedHeightIsKept) {
  Figure figure = TwoPanels();
  figure.height_mm = 100;
  EXPECT_NEAR(LayOut(figure, FigureStyles()[0]).height, PointsOf(100), 1e-9);
}

TEST(FigureFonts, ChineseIsThereAndWhatNoFontHasIsReported) {
  Figure figure = TwoPanels();
  figure.panels[0].y.label = "驱动力 *F* (N)";
  EXPECT_FALSE(LacksGlyphs(figure, FigureStyles()[0]));
  EXPECT_NE(TextsOf(DrawFigure(figure, FigureStyles()[0], PictureFormat::kPdf)).find("驱动力"),
            std::string::npos);
  figure.panels[0].y.label = "\U0010ABCD";  // for private use
  EXPECT_TRUE(LacksGlyphs(figure, FigureStyles()[0]));
}

}  // namespace
}  // namespace mbv
