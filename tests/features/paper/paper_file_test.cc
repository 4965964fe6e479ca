#include "features/paper/paper_file.h"

#include <gmock/gmock.h>

namespace mbv {
namespace {

using testing::HasSubstr;

constexpr const char* kWhole = R"yaml(source: "A. Author, 2020"
figures:
  fig2:
    title: Forces
    scenario: run
    beside: {other: {scenario: heavy, witness: simulated}}
    printed:
      as printed: {from: Table 1, at: [0, 0.5], unit: kN, signals: {d.force: [1, 2]}}
    panels: [{signals: d.force, marks: as printed, from_start: true, equal_scale: true}]
    says:
      - {text: agree, where: section 4, measure: difference, signals: d.force, of: simulated, to: other, printed: 0.1, unit: kN}
    differs: wrong sign
    audit: ["(6)"]
left_out:
  fig1: a sketch
)yaml";

std::string PaperFindings(std::string from, const std::string& to) {
  std::string text = kWhole;
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  Diagnostics diagnostics;
  const auto paper = LoadPaperText(text, "p.yaml", &diagnostics);
  EXPECT_EQ(paper.has_value(), !diagnostics.has_errors());
  return diagnostics.Text();
}

TEST(PaperFile, IsReadWhole) {
  Diagnostics diagnostics;
  const auto paper = LoadPaperText(kWhole, "p.yaml", &diagnostics);
  ASSERT_TRUE(paper) << diagnostics.Text();
  ASSERT_EQ(paper->entries.size(), 1u);
  const PaperEntry& entry = paper->entries[0];
  EXPECT_EQ(entry.name.text, "fig2");
  EXPECT_EQ(entry.scenario.text, "run");
  EXPECT_EQ(entry.beside.at(0).witness.text, "simulated");
  EXPECT_EQ(entry.printed.at(0).signals.at(0).second, (std::vector<double>{1, 2}));
  EXPECT_TRUE(entry.panels.at(0).from_start);
  EXPECT_TRUE(entry.panels.at(0).equal_scale);
  EXPECT_EQ(entry.panels.at(0).marks.at(0).text, "as printed");
  EXPECT_EQ(entry.statements.at(0).measure, PaperMeasure::kDifference);
  EXPECT_EQ(entry.statements.at(0).printed, 0.1);
  EXPECT_EQ(entry.audit.at(0).text, "(6)");
  EXPECT_EQ(paper->left_out.at(0).second, "a sketch");
}

TEST(PaperFile, BadInputIsReportedWithItsPlace) {
  EXPECT_THAT(PaperFindings("title: Forces", "titel: Forces"), HasSubstr("did you mean 'title'"));
  EXPECT_THAT(PaperFindings("measure: difference", "measure: diference"),
              HasSubstr("did you mean 'difference'"));
  EXPECT_THAT(PaperFindings("to: other, ", ""),
              HasSubstr("p.yaml:11:9: error: figures.fig2.says[0].to is missing: measure = "
                        "'difference' needs it"));
  EXPECT_THAT(PaperFindings("[0, 0.5]", "[0.5, 0.5]"), HasSubstr("does not grow"));
  EXPECT_THAT(PaperFindings("[1, 2]", "[1, 2, 3]"), HasSubstr("signals.d.force"));
  EXPECT_THAT(PaperFindings("fig2:", "\"fig 2\":"), HasSubstr("is not a name of files"));
  EXPECT_THAT(PaperFindings("    scenario: run\n", ""), HasSubstr("there is nothing to run"));
  EXPECT_THAT(PaperFindings("    differs: wrong sign", "    section: a.svg"),
              HasSubstr("give one of panels, maps, section and table"));
}

}  // namespace
}  // namespace mbv
