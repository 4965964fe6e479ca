// What is said about the source model.
#include "report/source_model_report.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

SourceModelError Sound(double force, double gap_m) {
  SourceModelError error;
  error.failure = "";
  error.force = error.force_all = force;
  error.gap_m = gap_m;
  error.gap_rad = 0.0;
  error.joint = "C";
  error.gap_at_s = 0.5;
  return error;
}

SourceModelAudit Example() {
  SourceModelAudit audit;
  audit.file = "robot.xml";
  audit.length_m = 1.0;
  audit.as_is = Sound(0.1, 1e-2);
  audit.causes.push_back({.key = "a",
                          .title = "loops",
                          .meaning = "Loops give.",
                          .without = Sound(0.01, 1e-4),
                          .alone = Sound(0.09, 1e-2)});
  audit.causes.push_back({.key = "b",
                          .title = "steps",
                          .meaning = "Steps cut.",
                          .without = Sound(0.08, 1e-2),
                          .alone = Sound(0.02, 1e-4)});
  audit.corrected = Sound(1e-4, 1e-6);
  return audit;
}

TEST(SourceModelReport, TheCauseThatTakesTheErrorWithItIsNamed) {
  SourceModelAudit audit = Example();
  ASSERT_EQ(audit.Culprits().size(), 1u);
  EXPECT_NE(CauseSentence(audit).find("made by one thing: loops. Loops give."), std::string::npos);
  audit.causes[1].without.force = 0.03;
  EXPECT_NE(CauseSentence(audit).find("loops; steps"), std::string::npos);
  // One that hides behind others shows when it is alone.
  audit.causes[0].without.force = audit.causes[1].without.force = 0.06;
  EXPECT_NE(CauseSentence(audit).find("one thing: loops."), std::string::npos);
  audit.causes[0].alone.force = 0.04;
  EXPECT_NE(CauseSentence(audit).find("No single thing"), std::string::npos);
}

TEST(SourceModelReport, WhatStaysWithAllCorrectedIsNotAMatterOfSettings) {
  SourceModelAudit audit = Example();
  EXPECT_EQ(CauseSentence(audit).find("another mechanism"), std::string::npos);
  audit.corrected.force = 0.05;
  EXPECT_NE(CauseSentence(audit).find("5 % of the force stays wrong"), std::string::npos);
  // Unless it grows with softness.
  for (const double softer : {0.049, 0.099, 0.101, 0.4}) {
    audit.softer = Sound(softer, 1e-5);
    const std::string text = CauseSentence(audit);
    EXPECT_EQ(text.find("still give way") != std::string::npos, softer > 0.1) << softer;
    EXPECT_EQ(text.find("another mechanism") != std::string::npos, softer < 0.1) << softer;
  }
}

TEST(SourceModelReport, ThePastedLinesAreQuotedAsAUserRunsThem) {
  SourceModelAudit audit = Example();
  audit.lines = "<option timestep=\"0.001\"/>\n";
  audit.pasted = Sound(1e-3, 1e-5);
  audit.pasted_as_is = Sound(0.07, 1e-5);
  audit.causes.push_back({.key = "drives", .title = "drives that lag", .meaning = "Servos."});
  const std::string html = ToHtml(SourceModelSection(audit, false));
  EXPECT_NE(html.find("1.00e-03"), std::string::npos);
  EXPECT_NE(html.find("nothing else changed: force error 7.00e-02"), std::string::npos);
  EXPECT_NE(html.find("what settings of loops leave: drives that lag"), std::string::npos);
  audit.pasted_as_is = Sound(0.002, 1e-5);
  EXPECT_EQ(ToHtml(SourceModelSection(audit, false)).find("what settings of loops leave"),
            std::string::npos);
}

TEST(SourceModelReport, GoodNeedsForcesAndLoops) {
  SourceModelAudit audit = Example();
  audit.as_is = Sound(0.99 * SourceModelAudit::kGoodForce, 0.99 * SourceModelAudit::kGoodGap);
  EXPECT_TRUE(audit.Good(audit.as_is));
  EXPECT_NE(SourceModelSentence(audit).find("nothing is wrong"), std::string::npos);
  audit.as_is.gap_m = 2.0 * SourceModelAudit::kGoodGap;
  EXPECT_FALSE(audit.Good(audit.as_is));
  EXPECT_NE(SourceModelSentence(audit).find("agree to 9.9e-03, but its loops open"),
            std::string::npos);
  audit.as_is = Sound(2.0 * SourceModelAudit::kGoodForce, 0.0);
  EXPECT_NE(SourceModelSentence(audit).find("off by 2 %"), std::string::npos)
      << SourceModelSentence(audit);
  audit.as_is.force = kNan;
  EXPECT_FALSE(audit.Good(audit.as_is));
}

TEST(SourceModelReport, UnsoundNumbersAreNoNumbers) {
  SourceModelAudit audit = Example();
  audit.as_is = {};
  audit.as_is.failure = "MuJoCo reset the simulation at 0.3 s";
  audit.as_is.time_s = 0.3;
  EXPECT_NE(SourceModelSentence(audit).find("reset the simulation at 0.3 s"), std::string::npos);
  const std::string text = ToText(SourceModelSection(audit, false));
  EXPECT_NE(text.find("  as your file is  "), std::string::npos) << text;
  EXPECT_NE(text.find("unsound"), std::string::npos) << text;
  const nlohmann::ordered_json json = SourceModelJson(audit);
  EXPECT_EQ(json["as_is"]["failure"], audit.as_is.failure);
  EXPECT_FALSE(json["as_is"].contains("force_nrmse"));
  EXPECT_FALSE(json["good"].get<bool>());
}

TEST(SourceModelReport, NamesOfTheFileAreEscapedOnThePage) {
  SourceModelAudit audit = Example();
  audit.as_is.joint = "<script>";
  audit.done = {"<b>"};
  audit.lines = "<option timestep=\"0.001\"/>\n";
  audit.pasted = Sound(1e-3, 1e-5);
  const std::string html = ToHtml(SourceModelSection(audit, false));
  EXPECT_EQ(html.find("<script>"), std::string::npos);
  EXPECT_EQ(html.find("<b>\n"), std::string::npos);
  EXPECT_NE(html.find("&lt;option timestep="), std::string::npos);
}

}  // namespace
}  // namespace mbv
