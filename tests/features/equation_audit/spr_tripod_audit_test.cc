// The 3-SPR mechanism's audit: every numbered equation has its row, the known errors are found in
// their known size, and every corrected form is confirmed.
#include "features/equation_audit/spr_tripod_audit.h"
#include "tests/support/source_dir.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace mbv {
namespace {

const AuditTable& TripodTable() {
  static const AuditTable table = AuditSprTripod(SourcePath("/models"));
  return table;
}

const AuditRow& RowFor(const std::string& equation) {
  const auto& rows = TripodTable().rows;
  const auto at = std::find_if(rows.begin(), rows.end(),
                               [&](const AuditRow& row) { return row.equation == equation; });
  EXPECT_NE(at, rows.end()) << equation;
  static const AuditRow none;
  return at == rows.end() ? none : *at;
}

TEST(SprTripodAudit, HasARowForEveryNumberedEquation) {
  for (int n = 1; n <= 22; ++n) {
    const std::string number = "(" + std::to_string(n) + ")";
    EXPECT_TRUE(std::any_of(TripodTable().rows.begin(), TripodTable().rows.end(),
                            [&](const AuditRow& row) { return row.equation.starts_with(number); }))
        << number;
  }
}

TEST(SprTripodAudit, ConfirmsEveryCorrectedForm) {
  for (const AuditRow& row : TripodTable().rows) {
    EXPECT_NE(row.verdict, AuditVerdict::kWrongAndUnfixed)
        << row.equation << ": " << row.residual_corrected << " > " << row.limit;
  }
}

TEST(SprTripodAudit, FindsTheKnownErrorsAndNoOthers) {
  std::vector<std::string> wrong;
  for (const AuditRow& row : TripodTable().rows) {
    if (row.verdict == AuditVerdict::kWrong) wrong.push_back(row.equation);
  }
  const std::vector<std::string> known = {
      "(6) x0, y0",      "(6) δ", "(6) δ in (2)",    "(7)", "(10)", "G(ψ, θ, z0) = 0",
      "(14) first form", "(20)",  "Table 1, R and h"};
  EXPECT_EQ(wrong, known);
}

TEST(SprTripodAudit, ErrorsHaveTheirKnownSizes) {
  const auto between = [](const char* equation, double low, double high) {
    EXPECT_GT(RowFor(equation).residual_printed, low) << equation;
    EXPECT_LT(RowFor(equation).residual_printed, high) << equation;
  };
  between("(6) x0, y0", 5e-3, 3.1e-2);  // 30 mm at 25 deg of tilt, as its square
  between("(6) δ", 3.0, 3.15);          // up to π
  between("(6) δ in (2)", 0.3, 0.46);
  between("(7)", 0.15, 0.36);
  between("(14) first form", 0.3, 1.5);
  between("(20)", 0.5, 8.0);
  between("G(ψ, θ, z0) = 0", 0.1, 1.0);
  between("Table 1, R and h", 0.24, 0.25);
}

TEST(SprTripodAudit, PrintedPositionsHoldInAFrameTurnedBy150Degrees) {
  for (const char* equation : {"(6) in a turned frame", "(7) in a turned frame"}) {
    EXPECT_EQ(RowFor(equation).verdict, AuditVerdict::kOk);
    EXPECT_GT(RowFor(equation).scale, 0.1);
  }
}

TEST(SprTripodAudit, APerturbedEquationIsFoundOut) {
  // The limits are close enough to see a dimension that is 1e-9 m wrong.
  spr_tripod_audit::Case c = spr_tripod_audit::MakeCase(SourcePath("/models"));
  c.geometry.a += 1e-9;
  int unconfirmed = 0;
  for (const AuditRow& row : spr_tripod_audit::PositionRows(c)) {
    unconfirmed += row.verdict == AuditVerdict::kWrongAndUnfixed;
  }
  EXPECT_GE(unconfirmed, 6);
  c.closed[3].f.f[1] += 1e-6;
  unconfirmed = 0;
  for (const AuditRow& row : spr_tripod_audit::DynamicsRows(c)) {
    unconfirmed += row.verdict == AuditVerdict::kWrongAndUnfixed;
  }
  EXPECT_EQ(unconfirmed, 1);
}

}  // namespace
}  // namespace mbv
