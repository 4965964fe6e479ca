#include "plot/draw.h"

#include <gmock/gmock.h>

#include <sstream>

#include "base/png.h"
#include "features/paper/figures.h"
#include "tests/support/golden_figure.h"
#include "tests/support/read_back.h"

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

TEST(Pgf, MapsArePicturesOfTheirOwn) {
  Figure figure{.name = "map", .panels = {FigurePanel{}, FigurePanel{}}};
  MapPlot map;
  map.columns = 2;
  map.rows = 2;
  map.values = {10, kNan, 1000, 1000};  // the lower row first
  map.log_scale = true;
  figure.panels[0].map = map;
  map.values[2] = 100;
  figure.panels[1].map = map;
  const auto files = PgfFiles(figure, FigureStyles()[0]);
  ASSERT_EQ(files.size(), 3u);
  EXPECT_THAT(files[0].second, testing::HasSubstr("ymax=1] {map_map.png};"));
  EXPECT_THAT(files[0].second, testing::HasSubstr("{map_map2.png};"));
  // The bar's ends are those of the colours: 10 at its foot, 1000 at its head.
  for (const char* label : {"10^{1}", "10^{2}", "10^{3}"}) {
    EXPECT_THAT(files[0].second, testing::HasSubstr(") {" + ToTex(label) + "};"));
  }
  EXPECT_THAT(files[0].second, testing::HasSubstr("axis on top"));  // white hides no axis
  EXPECT_EQ(files[1].first, "map_map.png");
  EXPECT_EQ(files[2].first, "map_map2.png");
  Picture picture;
  ASSERT_TRUE(DecodePng(files[1].second, 1000, &picture));
  const auto color = [&](int x, int y) {
    const size_t at = 3 * static_cast<size_t>(y * picture.width + x);
    return Rgb{picture.rgb[at], picture.rgb[at + 1], picture.rgb[at + 2]};
  };
  const int right = picture.width - 1, below = picture.height - 1;
  EXPECT_EQ(color(0, 0), MapColor(1));
  EXPECT_EQ(color(0, below), MapColor(0));
  EXPECT_EQ(color(right, below), (Rgb{255, 255, 255}));
  EXPECT_NE(files[1].second, files[2].second);
}

}  // namespace
}  // namespace mbv
