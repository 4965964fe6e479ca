// Accuracy tables of documents.
#include "features/regress/accuracy.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

constexpr const char* kSummary = R"({
  "simulation": {"mode": "forward", "step_s": 0.001}, "duration_s": 2.0,
  "metrics": {"simulated_vs_analytic": {"force_nrmse": 1.63e-13, "closure_max_m": 2e-9}},
  "checks": [{"name": "simulated_vs_analytic.pose_m", "value": 3e-11, "limit": 4.5e-6}],
  "engine_error": {"defaults": {"force_nrmse": 0.95}}})";

std::string Document(const std::string& rows) {
  return "Text | `a/b` | 7 |\n<!-- accuracy: written by mbverify regress --tables -->\n"
         "| scenario | simulation vs analytic | step | default MuJoCo | remark "
         "|\n|---|---|---|---|---|\n" +
         rows + "<!-- accuracy: end -->\nAfter.\n";
}

TEST(AccuracyTables, AreFilledByTheirHeadings) {
  const auto summary = [](const std::string& scenario) -> std::optional<std::string> {
    if (scenario == "a/b") return kSummary;
    return {};
  };
  EXPECT_EQ(
      FillAccuracyTables(
          Document("| `a/b` (fast) | ? | ? | ? | mine |\n| `a/c` | 1 | 2 | 3 | 4 |\n"), summary),
      Document("| `a/b` (fast) | 1.6e-13 | 1 ms | 0.95 | mine |\n| `a/c` | 1 | 2 | 3 | 4 |\n"));
}

TEST(AccuracyTables, TakeNumbersOfChecksAndSayWhatWasNotMeasured) {
  EXPECT_EQ(AccuracyText("motion error", kSummary), "3.0e-11 m");
  EXPECT_EQ(AccuracyText("perturbed forces lead", kSummary), "4.5e-06 m");
  EXPECT_EQ(AccuracyText("best recipe", kSummary), "–");
  EXPECT_EQ(AccuracyText("horizon", kSummary), "2 s");
  EXPECT_EQ(AccuracyText("colour", kSummary), std::nullopt);
}

TEST(AccuracyTables, CellsAreFoundAndComparedUpToRoundOff) {
  const auto cells = AccuracyCells(Document("| `a/b` | 1.6e-13 | 1 ms | 0.95 | |\n"));
  ASSERT_GE(cells.size(), 3U);
  EXPECT_EQ(cells[0].scenario, "a/b");
  EXPECT_EQ(cells[0].heading, "simulation vs analytic");
  EXPECT_TRUE(SameAccuracy("1.6e-13", "4.0e-15"));
  EXPECT_TRUE(SameAccuracy("1.6e-08", "2.1e-08"));
  EXPECT_FALSE(SameAccuracy("1.6e-08", "3.5e-08"));
  EXPECT_FALSE(SameAccuracy("1 ms", "1 s"));
  EXPECT_FALSE(SameAccuracy("–", "1.6e-08"));
}

}  // namespace
}  // namespace mbv
