#include "features/paper/paper_figures.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "base/markup.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::string DocText(const std::string& name) {
  std::ifstream stream(std::string(kSourceDir) + "/docs/results/" + name);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

PaperFile PaperOf(const std::string& model) {
  Diagnostics diagnostics;
  const auto paper =
      LoadPaper(std::string(kSourceDir) + "/models/" + model + "/paper.yaml", &diagnostics);
  EXPECT_TRUE(paper) << diagnostics.Text();
  return paper.value_or(PaperFile{});
}

const std::vector<std::string> kPapers = {"cabin_robot", "scara_robot", "spr_tripod",
                                          "stabilizing_platform"};

FigureOptions AsSvg(const std::vector<std::string>& only) {
  FigureOptions options;
  options.formats = {"svg"};
  options.only = only;
  return options;
}

TEST(PaperFigures, EveryEntryIsOnThePageWithItsPictureAndItsAuditRows) {
  const std::string page = DocText("paper_figures.md"), audit = DocText("equation_audit.md");
  for (const std::string& model : kPapers) {
    const size_t table = audit.find("\n## " + model);
    ASSERT_NE(table, std::string::npos) << model;
    const std::string rows = audit.substr(table, audit.find("\n## ", table + 1) - table);
    const PaperFile paper = PaperOf(model);
    EXPECT_FALSE(paper.entries.empty());
    for (const PaperEntry& entry : paper.entries) {
      EXPECT_THAT(page, HasSubstr("### " + entry.name.text + ": " + MarkdownText(entry.title)));
      if (entry.columns.empty()) {
        EXPECT_THAT(page, HasSubstr("paper_" + model + "_" + entry.name.text + ".png"));
      }
      for (const PlacedText& row : entry.audit) {
        EXPECT_THAT(rows, HasSubstr("\n| " + row.text + " |")) << entry.name.path;
      }
    }
  }
}

TEST(PaperFigures, MapsAreDrawnAndMeasured) {
  const PaperOutcome outcome =
      MakePaperFigures("scara_robot", PaperOf("scara_robot"), AsSvg({"fig11", "fig8"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  ASSERT_EQ(outcome.results.size(), 1u);
  ASSERT_EQ(outcome.left_out.size(), 1u);
  EXPECT_EQ(outcome.left_out[0].first, "fig8");
  const PaperResult& result = outcome.results[0];
  EXPECT_THAT(result.files, ElementsAre("fig11.svg"));
  ASSERT_EQ(result.said.size(), 3u);
  EXPECT_GT(result.said[0].deviation(), 10);  // % of the largest: not symmetric
  EXPECT_LT(result.said[2].measured, 1e-8);   // but each the other's mirror image
  EXPECT_THAT(result.caption, HasSubstr("printed 0 %, computed"));
}

TEST(PaperFigures, Table2HoldsTheDigitsOfThePrintAndCountsItsDeviations) {
  PaperFile paper = PaperOf("cabin_robot");
  const FigureOptions options = AsSvg({"table2"});
  const PaperOutcome outcome = MakePaperFigures("cabin_robot", paper, options);
  ASSERT_EQ(outcome.results.size(), 1u) << outcome.diagnostics.Text();
  const PaperResult& result = outcome.results[0];
  EXPECT_THAT(result.files, ElementsAre("table2.md", "table2.tex"));
  EXPECT_THAT(result.table, HasSubstr("\n| 46 | 0.015 | 0.162 | 0.128 | 0.019 | 0.178 | 0.133 |"));
  EXPECT_NEAR(result.said[0].measured, 100.0 * 3 / 33, 1e-9);
  // One printed number perturbed beyond 15 %.
  for (PaperEntry& entry : paper.entries) {
    if (entry.name.text == "table2") entry.printed[0].signals[1].second[10] = 0.110;
  }
  const PaperOutcome perturbed = MakePaperFigures("cabin_robot", paper, options);
  EXPECT_NEAR(perturbed.results.at(0).said[0].measured, 100.0 * 4 / 33, 1e-9);
  EXPECT_THAT(perturbed.results[0].table, HasSubstr("0.110"));
  EXPECT_THAT(PaperPage({outcome}), HasSubstr(result.table));
}

TEST(PaperFigures, WhatDoesNotExistIsReportedAndNothingIsDrawn) {
  const PaperFile paper = PaperOf("scara_robot");
  PaperOutcome outcome = MakePaperFigures("scara_robot", paper, AsSvg({"fig13"}));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.diagnostics.Text(), HasSubstr("fig13: there is no such figure"));
  PaperFile bad = paper;
  bad.entries[0].scenario.text = "nowhere";
  bad.entries[0].maps.clear();
  bad.entries[0].panels.resize(1);
  outcome = MakePaperFigures("scara_robot", bad, AsSvg({"fig9"}));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(outcome.files.empty());
  EXPECT_THAT(outcome.diagnostics.Text(), HasSubstr("there is no scenario"));
}

}  // namespace
}  // namespace mbv
