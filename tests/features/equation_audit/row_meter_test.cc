// How residuals are collected and written.
#include "features/equation_audit/audit.h"

#include <gtest/gtest.h>

#include "base/types.h"

namespace mbv {
namespace {

RowMeter Meter(double limit = 1e-9) {
  return RowMeter(TextRow("(1)", "a", "b", "m", limit, "compared by hand"));
}

TEST(RowMeter, KeepsTheLargestOfEach) {
  RowMeter meter = Meter();
  meter.Add(1.0, 1.25, 1.0);
  meter.Add(-4.0, -3.5, -4.0 + 5e-10);
  meter.Add(2.0, 2.0, 2.0 - 2e-10);
  const AuditRow row = meter.Finish();
  EXPECT_EQ(row.residual_printed, 0.5);
  EXPECT_NEAR(row.residual_corrected, 5e-10, 1e-15);
  EXPECT_EQ(row.scale, 4.0);
  EXPECT_EQ(row.verdict, AuditVerdict::kWrong);
  EXPECT_EQ(row.equation, "(1)");
  EXPECT_EQ(row.printed, "a");
  EXPECT_EQ(row.corrected, "b");
  EXPECT_EQ(row.unit, "m");
  EXPECT_EQ(row.limit, 1e-9);
  EXPECT_EQ(row.note, "compared by hand");
}

TEST(RowMeter, OneFormIsPrintAndCorrection) {
  RowMeter meter = Meter();
  meter.Add(3.0, 3.0 + 4e-10);
  const AuditRow row = meter.Finish();
  EXPECT_EQ(row.residual_printed, row.residual_corrected);
  EXPECT_EQ(row.verdict, AuditVerdict::kOk);
}

// Perturbed by twice the limit at one state of many.
TEST(RowMeter, OnePerturbedStateIsEnough) {
  for (const int perturbed : {0, 5, 9}) {
    RowMeter meter = Meter();
    for (int state = 0; state < 10; ++state) {
      const double truth = std::sin(1.0 + state);
      meter.Add(truth, truth + 0.5, truth + (state == perturbed ? 2e-9 : 0.0));
    }
    EXPECT_EQ(meter.Finish().verdict, AuditVerdict::kWrongAndUnfixed) << perturbed;
  }
}

TEST(RowMeter, WhatIsNotANumberStays) {
  for (const int state : {0, 1, 2}) {
    RowMeter meter = Meter();
    for (int k = 0; k < 3; ++k) meter.Add(1.0, 1.0, k == state ? kNan : 1.0);
    const AuditRow row = meter.Finish();
    EXPECT_TRUE(std::isnan(row.residual_corrected)) << state;
    EXPECT_EQ(row.residual_printed, 0.0);
    EXPECT_EQ(row.verdict, AuditVerdict::kWrongAndUnfixed) << state;
  }
}

TEST(RowMeter, StartsAtNothing) {
  AuditRow row = TextRow("", "", "", "", 0.0, "");
  row.residual_printed = row.residual_corrected = row.scale = 7.0;
  const AuditRow empty = RowMeter(row).Finish();
  EXPECT_EQ(empty.residual_printed, 0.0);
  EXPECT_EQ(empty.residual_corrected, 0.0);
  EXPECT_EQ(empty.scale, 0.0);
}

AuditTable TableOf(const AuditRow& row) { return {.mechanism = "m", .source = "p", .rows = {row}}; }

AuditRow WrittenRow() {
  AuditRow row = TextRow("(2)", "x", "y", "1", 9.5e-13, "n");
  row.residual_printed = 0.25;
  row.residual_corrected = 2e-13;
  row.scale = 3.14159;
  row.verdict = AuditVerdict::kWrong;
  return row;
}

TEST(AuditTexts, EveryVerdictHasItsWord) {
  EXPECT_STREQ(ToText(AuditVerdict::kOk), "right");
  EXPECT_STREQ(ToText(AuditVerdict::kWrong), "wrong as printed");
  EXPECT_STREQ(ToText(AuditVerdict::kApproximation), "approximation");
  EXPECT_STREQ(ToText(AuditVerdict::kWrongAndUnfixed), "NOT CONFIRMED");
  EXPECT_STREQ(ToText(AuditVerdict::kNotTestable), "no residual");
}

TEST(AuditTexts, LimitsAreRoundedUpToOneDigit) {
  AuditRow row = WrittenRow();
  const auto line = [&] { return ToMarkdown(TableOf(row)); };
  EXPECT_NE(line().find("| 2.5e-01 | ≤ 1e-12 | 3.1 | n |"), std::string::npos) << line();
  row.limit = 3e-12;
  EXPECT_NE(line().find("≤ 3e-12 |"), std::string::npos) << line();
  row.limit = 3.1e-12;
  EXPECT_NE(line().find("≤ 4e-12 |"), std::string::npos) << line();
  row.limit = 1.5;
  EXPECT_NE(line().find("| ≤ 2e+00 | ≤ 2e+00 |"), std::string::npos) << line();
}

TEST(AuditTexts, WhatMissesItsLimitIsShown) {
  AuditRow row = WrittenRow();
  row.residual_corrected = 2e-12;
  EXPECT_NE(ToMarkdown(TableOf(row)).find("| 2.5e-01 | 2.0e-12 |"), std::string::npos);
  row.residual_printed = kNan;
  EXPECT_NE(ToMarkdown(TableOf(row)).find("| not evaluated | 2.0e-12 |"), std::string::npos);
  row.corrected.clear();
  EXPECT_NE(ToMarkdown(TableOf(row)).find("| not evaluated | – | 3.1 |"), std::string::npos);
}

TEST(AuditTexts, RowsWithoutAResidualHaveNoNumbers) {
  AuditRow row = WrittenRow();
  row.verdict = AuditVerdict::kNotTestable;
  row.note = "two\nlines";
  EXPECT_NE(
      ToMarkdown(TableOf(row)).find("| (2) |  | no residual | x | y | – | – | – | two lines |"),
      std::string::npos)
      << ToMarkdown(TableOf(row));
}

}  // namespace
}  // namespace mbv
