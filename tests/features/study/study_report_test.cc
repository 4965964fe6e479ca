// A study's page, terminal text and JSON: every number and word that decisions rest on.
#include "features/study/study_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace mbv {
namespace {

StudyReport TwoPoints(double share) {
  StudyReport report;
  Study& study = report.study;
  study.name = "drives";
  study.scenario = "s.yaml";
  study.factors = {{.name = "m<p>", .key = "parameters.m<p>", .axis = {1.0, Normal{1.0, 0.1}}}};
  study.quantities = {{.name = "x.force.max", .channel = "x.force"}};
  study.limits = {{.quantity = 0, .below = 15.0, .above = {}, .share = share}};
  study.design = {.kind = DesignKind::kSobol, .count = 2};
  report.nominal = {10.0};
  report.summary = SummariseStudy(study, report.nominal, [](const auto& take) {
    take({.point = 0, .reason = {}, .varied = {1.1}, .values = {11.0}});
    take({.point = 1, .reason = {}, .varied = {1.9}, .values = {19.0}});
  });
  report.worst_commands = {{"mbverify run s.yaml --set 'a=<1>'", "second"}};
  report.bands = {{.drive = "x",
                   .unit = "N",
                   .time_s = {0.0, 1.0},
                   .nominal = {10, 10},
                   .lower = {11, 11},
                   .median = {15, 15},
                   .upper = {19, 19},
                   .points = 2}};
  report.versions = {{"mbverify", "1"}};
  return report;
}

TEST(StudyReport, AVerdictIsReportedTheSameEverywhere) {
  const StudyReport violated = TwoPoints(0.49), kept = TwoPoints(0.5);
  EXPECT_EQ(violated.exit_code(), 1);
  EXPECT_EQ(kept.exit_code(), 0);
  EXPECT_NE(ToText(violated).find("x.force.max < 15  VIOLATED  1 of 2 points violate it (50 %"),
            std::string::npos)
      << ToText(violated);
  EXPECT_EQ(ToText(kept).find("VIOLATED"), std::string::npos);
  EXPECT_NE(ToHtml(violated).find("Limit violated"), std::string::npos);
  EXPECT_NE(ToHtml(kept).find("Limits kept"), std::string::npos);
  EXPECT_FALSE(nlohmann::json::parse(ToJson(violated))["limits"][0]["pass"].get<bool>());
  EXPECT_TRUE(nlohmann::json::parse(ToJson(kept))["limits"][0]["pass"].get<bool>());
}

// Five bins from 11 to 19; the two points lie in the first and in the last.
TEST(StudyReport, AHistogramsBinsReachFromTheLeastToTheMost) {
  const std::vector<StudyPlot> plots = StudyPlots(TwoPoints(0.0));
  const auto histogram = std::ranges::find(plots, StudySection::kHistograms, &StudyPlot::section);
  ASSERT_NE(histogram, plots.end());
  ASSERT_TRUE(histogram->lines);
  const auto& outline = histogram->lines->lines.at(0).points;
  ASSERT_EQ(outline.size(), 2u + 2u * 5u);
  for (size_t k = 0; k < 5; ++k) {
    const double left = 11.0 + 1.6 * static_cast<double>(k);
    const double count = k == 0 || k == 4 ? 1.0 : 0.0;
    EXPECT_NEAR(outline[1 + 2 * k].first, left, 1e-12) << k;
    EXPECT_NEAR(outline[2 + 2 * k].first, left + 1.6, 1e-12) << k;
    EXPECT_EQ(outline[1 + 2 * k].second, count) << k;
    EXPECT_EQ(outline[2 + 2 * k].second, count) << k;
  }
}

TEST(StudyReport, HasNumbersCommandsAndBands) {
  const StudyReport report = TwoPoints(0.0);
  const auto json = nlohmann::json::parse(ToJson(report));
  EXPECT_EQ(json["schema"], "mbverify.study_summary/1");
  EXPECT_EQ(json["quantities"][0]["most"], 19.0);
  EXPECT_EQ(json["quantities"][0]["worst"][0]["varied"]["m<p>"], 1.9);
  EXPECT_EQ(json["force_bands"][0]["most"][1], 19.0);
  EXPECT_FALSE(json["force_bands"][0].contains("p95")) << "of two points";
  EXPECT_NE(ToText(report).find("mbverify run s.yaml --set 'a=<1>'"), std::string::npos);
  const std::string page = ToHtml(report);
  EXPECT_NE(page.find("--set &#39;a=&lt;1&gt;&#39;"), std::string::npos) << page.substr(0, 200);
  EXPECT_EQ(page.find("m<p>"), std::string::npos);
  EXPECT_NE(page.find("drive force [N]"), std::string::npos);
}

TEST(StudyReport, SaysFirstWhatIsVariedAndHowMuch) {
  StudyReport report = TwoPoints(0.0);
  report.study.factors.push_back(
      {.name = "length", .key = "parameters.length", .axis = {2.0, Uniform{1.9, 2.1}}});
  report.study.factors.push_back(
      {.name = "screw", .key = "parameters.screw", .axis = {0.0, Levels{{1.0, 2.5}}}});
  report.idle = {"screw"};
  const std::string page = ToHtml(report);
  for (const char* text : {"σ = 0.1 (10 %)", "1.9 … 2.1 (±5 %)", "1, 2.5", "moves no quantity"}) {
    EXPECT_NE(page.find(text), std::string::npos) << text;
  }
  EXPECT_LT(page.find("σ = 0.1"), page.find("x.force.max &lt; 15"));
}

TEST(StudyReport, WideIntervalsAndPartsLargerThanTheWholeAreNamed) {
  StudyReport report = TwoPoints(0.0);
  SobolResult sobol{.indices = {{0.4, 0.5, {0.35, 0.45}, {0.42, 0.58}}},
                    .mean = 1,
                    .variance = 1,
                    .blocks = 64,
                    .left_out = 0};
  report.summary.quantities[0].sobol = sobol;
  EXPECT_EQ(ToText(report).find("do not resolve"), std::string::npos);
  EXPECT_EQ(ToText(report).find("above total"), std::string::npos);
  sobol.indices[0].first_interval = {0.2, 0.45};
  report.summary.quantities[0].sobol = sobol;
  EXPECT_NE(ToText(report).find("64 blocks do not resolve the indices of x.force.max: an interval "
                                "is 0.25 wide"),
            std::string::npos)
      << ToText(report);
  sobol.indices[0].first = 0.51;
  report.summary.quantities[0].sobol = sobol;
  EXPECT_NE(ToText(report).find("First order above total (m<p>)"), std::string::npos);
}

TEST(StudyReport, LargeForcesAreShownInKilonewtons) {
  StudyReport report = TwoPoints(0.0);
  for (auto* values : {&report.bands[0].nominal, &report.bands[0].lower, &report.bands[0].upper}) {
    for (double& value : *values) value *= 1e4;
  }
  EXPECT_NE(ToHtml(report).find("drive force [kN]"), std::string::npos);
}

TEST(StudyReport, WithoutLimitsOrResultsSaysSo) {
  StudyReport report = TwoPoints(0.0);
  report.study.limits.clear();
  report.summary.limits.clear();
  EXPECT_EQ(report.exit_code(), 0);
  EXPECT_EQ(ToHtml(report).find("class=\"verdict"), std::string::npos);  // nothing is judged
  report.summary.failed = report.summary.points;
  EXPECT_EQ(report.exit_code(), 3);
  EXPECT_NE(ToHtml(report).find("No result"), std::string::npos);
}

}  // namespace
}  // namespace mbv
