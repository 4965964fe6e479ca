#include "plot/style.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/golden_figure.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

std::optional<FigureStyle> StyleOf(const std::string& text, std::string* findings) {
  const test::TestFolder folder("style");
  Diagnostics diagnostics;
  auto style = LoadFigureStyle(folder.Write("style.yaml", text), &diagnostics);
  *findings = diagnostics.Text();
  const std::string path = folder.PathOf("");
  for (size_t at = 0; (at = findings->find(path)) != std::string::npos;) {
    findings->erase(at, path.size());
  }
  return style;
}

TEST(StyleFile, ChangesWhatItStatesAndLeavesTheRest) {
  std::string findings;
  const auto style = StyleOf(
      "based_on: springer\nfont: Charis SIL\nfont_pt: 9\nwidth_mm: 150\nline_pt: 1\n"
      "axis_pt: 0.4\nmarker_pt: 4\ndpi: 600\ncolors: [\"#112233\"]\ndashes: [[], [6, 2]]\n",
      &findings);
  EXPECT_EQ(findings, "");
  ASSERT_TRUE(style);
  EXPECT_EQ(style->font, "Charis SIL");
  EXPECT_EQ(style->font_pt, 9);
  EXPECT_EQ(style->width_mm, 150);
  EXPECT_EQ(style->line_pt, 1);
  EXPECT_EQ(style->axis_pt, 0.4);
  EXPECT_EQ(style->marker_pt, 4);
  EXPECT_EQ(style->dpi, 600);
  EXPECT_EQ(style->colors, std::vector<std::string>{"#112233"});
  EXPECT_EQ(style->dashes, (std::vector<std::vector<double>>{{}, {6, 2}}));
  const auto other = StyleOf("font_pt: 9\n", &findings);
  EXPECT_EQ(other->width_mm, FindFigureStyle("ieee")->width_mm);
  EXPECT_EQ(other->font, FindFigureStyle("ieee")->font);
}

TEST(StyleFile, AllMistakesAreReportedWithTheirPlaces) {
  std::string findings;
  EXPECT_FALSE(
      StyleOf("based_on: spriner\nfont_pt: 0\nwidth_mm: wide\nline: 1\ncolors: [red, \"#12345g\"]\n"
              "dashes: [[6], [2, -1], 3]\n",
              &findings));
  test::ExpectFigureGolden("style_mistakes.txt", findings);
}

TEST(StyleFile, LinesOfOnePatternAreAWarning) {
  std::string findings;
  EXPECT_TRUE(StyleOf("dashes: [[], [6, 2], [6, 2]]\n", &findings));
  EXPECT_NE(findings.find("style.yaml:1:22: warning: dashes[2] is like another one"),
            std::string::npos)
      << findings;
}

}  // namespace
}  // namespace mbv
