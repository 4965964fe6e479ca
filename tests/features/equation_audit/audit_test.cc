// The audit's own judgement, and docs/results/equation_audit.md kept in step.
#include "features/equation_audit/audit.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "base/types.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

AuditRow Row() {
  return {.equation = "(6) M",
          .erratum = "E2",
          .printed = "- a|b",
          .corrected = "+ a|b",
          .residual_printed = 1.53e-2,
          .residual_corrected = 3.1e-13,
          .scale = 0.41,
          .limit = 2.5e-12,
          .unit = "m/s",
          .verdict = AuditVerdict::kWrong,
          .note = "finite differences"};
}

TEST(AuditVerdict, FollowsTheNumbers) {
  AuditRow row = Row();
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kWrong);
  row.residual_printed = 2e-13;
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kOk);
  row.residual_corrected = 2 * row.limit;
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kWrongAndUnfixed);
}

TEST(AuditVerdict, NeverPassesNaN) {
  AuditRow row = Row();
  row.residual_corrected = kNan;
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kWrongAndUnfixed);
}

TEST(AuditVerdict, ReportsAnApproximationFromAnErrorByHowNearItIs) {
  AuditRow row = Row();
  row.approximation = 2e-2;
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kApproximation);
  row.residual_printed = 2 * row.approximation;
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kWrong);
  row.residual_printed = 1e-2;
  row.residual_corrected = 2 * row.limit;
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kWrongAndUnfixed);
}

// A corrected form whose limit is as large as the quantity itself is not confirmed by it.
TEST(AuditTables, NoLimitExceedsTwoPercentOfItsQuantity) {
  for (const AuditEntry& entry : Audits()) {
    for (const AuditRow& row : entry.run(SourcePath("/models")).rows) {
      if (row.verdict == AuditVerdict::kNotTestable) continue;
      if (row.scale == 0.0) continue;  // said to vanish: nothing to measure the limit by
      EXPECT_LE(row.limit, 0.02 * row.scale) << entry.mechanism << " " << row.equation;
    }
  }
}

TEST(AuditVerdict, TakesAPrintThatCannotBeComputedAsWrong) {
  AuditRow row = Row();
  row.residual_printed = kNan;
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kWrong);
}

TEST(AuditVerdict, RefusesAWrongPrintWithoutCorrection) {
  AuditRow row = Row();
  row.corrected.clear();
  EXPECT_EQ(VerdictOf(row), AuditVerdict::kWrongAndUnfixed);
}

TEST(AuditMarkdown, ShowsTheLimitInsteadOfRoundoffAndEscapesBars) {
  const AuditTable table{.mechanism = "m", .source = "a paper", .rows = {Row()}};
  const std::string text = ToMarkdown(table);
  EXPECT_NE(text.find("| (6) M | E2 | wrong as printed | - a\\|b | + a\\|b | 1.5e-02 | ≤ 3e-12 | "
                      "0.41 m/s | finite differences |"),
            std::string::npos)
      << text;
  EXPECT_EQ(text.find("3.1e-13"), std::string::npos) << text;
  EXPECT_NE(ToMarkdown(table, AuditNumbers::kMeasured).find("3.1e-13"), std::string::npos);
}

TEST(AuditMarkdown, IsTheSameForResidualsThatDifferByRoundoff) {
  AuditTable table{.mechanism = "m", .source = "a paper", .rows = {Row()}};
  const std::string text = ToMarkdown(table);
  table.rows[0].residual_corrected *= 4;
  EXPECT_EQ(ToMarkdown(table), text);
}

// Update with MBV_UPDATE_GOLDEN=1.
TEST(EquationAudit, DocumentIsInStep) {
  const std::string root = kSourceDir;
  const std::string path = root + "/docs/results/equation_audit.md";
  const std::string text = AuditDocument(root + "/models");
  if (std::getenv("MBV_UPDATE_GOLDEN") != nullptr) std::ofstream(path) << text;
  std::ifstream file(path);
  std::ostringstream stored;
  stored << file.rdbuf();
  EXPECT_EQ(stored.str(), text) << "docs/results/equation_audit.md is stale; rerun with "
                                   "MBV_UPDATE_GOLDEN=1";
}

}  // namespace
}  // namespace mbv
