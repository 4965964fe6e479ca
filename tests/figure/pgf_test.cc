#include "figure/pgf.h"

#include <gmock/gmock.h>

#include <sstream>

#include "figure/default_figures.h"
#include "tests/figure/golden_figure.h"
#include "tests/figure/read_back.h"

namespace mbv {
namespace {

Figure SmallFigure() {
  Figure figure{.name = "small", .common_x = true};
  FigurePanel upper{.x = {.label = "Time *t* (s)"}, .y = {.label = "Force *F* (N)"}};
  upper.curves = {{.label = "drive\\_p", .points = {{0, 1}, {1, 4}, {2, 2.5}}, .look = 1},
                  {.points = {{0, 3}, {1, kNan}}, .look = 2, .line = false, .marker = 1},
                  {.label = "simulation", .look = -1, .line = false, .marker = 1}};
  FigurePanel lower{.x = {.label = "Time *t* (s)"}, .y = {.label = "|Δ*F*| (N)", .log = true}};
  lower.curves = {{.label = "", .points = {{0, 1e-9}, {2, 1e-6}}, .look = 0}};
  figure.panels = {upper, lower};
  return figure;
}

TEST(Pgf, SourceAndDataStayAsTheyWereRead) {
  for (const auto& [name, content] : PgfFiles(SmallFigure(), FigureStyles()[0])) {
    test::ExpectFigureGolden(name, content);
  }
}

TEST(Pgf, BracketsAndGroupsAreClosed) {
  for (const auto& [name, content] : PgfFiles(SmallFigure(), FigureStyles()[1])) {
    for (const char* pair : {"{}", "[]"}) {
      EXPECT_EQ(std::count(content.begin(), content.end(), pair[0]),
                std::count(content.begin(), content.end(), pair[1]))
          << name << pair;
    }
  }
}

TEST(Pgf, TheDataAreTheSamples) {
  const synthetic::Case c;
  const FigureSet set = DefaultFigures(test::SampledReport(c), Language::kEnglish);
  const auto files = PgfFiles(set.figures[0], FigureStyles()[0]);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[1].first, "drive_forces.dat");
  std::istringstream lines(files[1].second);
  std::string head;
  std::getline(lines, head);
  EXPECT_TRUE(head.starts_with("x0 y0 x1 y1")) << head;
  const int column = c.analytic.Find("d1.force");
  for (size_t i = 0; i < c.analytic.time_s.size(); ++i) {
    std::string line;
    std::getline(lines, line);
    double t = kNan, force = kNan;
    std::istringstream(line) >> t >> force;
    EXPECT_NEAR(t, c.analytic.time_s[i], 1e-10);
    EXPECT_NEAR(force, c.analytic.values(static_cast<Eigen::Index>(i), column), 1e-7);
  }
}

TEST(Pgf, ALogarithmicMapGivesLogarithms) {
  Figure figure{.name = "map", .panels = {FigurePanel{}}};
  MapPlot map;
  map.columns = 2;
  map.rows = 1;
  map.values = {10, kNan};
  map.log_scale = true;
  figure.panels[0].map = map;
  const auto files = PgfFiles(figure, FigureStyles()[0]);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[1].second, "x y c\n0.25 0.5 1\n0.75 0.5 nan\n");
  EXPECT_THAT(files[0].second, testing::HasSubstr("mesh/cols=2"));
}

}  // namespace
}  // namespace mbv
