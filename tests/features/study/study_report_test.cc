// A study's page, terminal text and JSON: every number and word that people decide by.
#include "features/study/study_report.h"

#include <gtest/gtest.h>

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
                   .p5 = {11, 11},
                   .p50 = {15, 15},
                   .p95 = {19, 19},
                   .points = 2}};
  report.versions = {{"mbverify", "1"}};
  return report;
}

TEST(StudyReport, AVerdictIsToldTheSameEverywhere) {
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

TEST(StudyReport, HasNumbersCommandsAndBands) {
  const StudyReport report = TwoPoints(0.0);
  const auto json = nlohmann::json::parse(ToJson(report));
  EXPECT_EQ(json["schema"], "mbverify.study_summary/1");
  EXPECT_EQ(json["quantities"][0]["most"], 19.0);
  EXPECT_EQ(json["quantities"][0]["worst"][0]["varied"]["m<p>"], 1.9);
  EXPECT_EQ(json["force_bands"][0]["p95"][1], 19.0);
  EXPECT_NE(ToText(report).find("mbverify run s.yaml --set 'a=<1>'"), std::string::npos);
  const std::string page = ToHtml(report);
  EXPECT_NE(page.find("--set &#39;a=&lt;1&gt;&#39;"), std::string::npos) << page.substr(0, 200);
  EXPECT_EQ(page.find("m<p>"), std::string::npos);
  EXPECT_NE(page.find("drive force [N]"), std::string::npos);
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
