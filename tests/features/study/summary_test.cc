// What points say together: shares of violations, worst points, swings, with numbers by hand.
#include "features/study/summary.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

// Rows with the values 1 … count of one quantity, varied the same.
PointRows Counting(int count) {
  return [count](const std::function<void(const PointRow&)>& take) {
    for (int i = 0; i < count; ++i) {
      const double value = i + 1.0;
      take({.point = static_cast<std::uint64_t>(i),
            .reason = {},
            .varied = {value},
            .values = {value}});
    }
  };
}

Study OneQuantity(DesignKind kind) {
  Study study;
  study.factors = {{.name = "x", .key = "parameters.x", .axis = {0.0, Uniform{0.0, 101.0}}}};
  study.quantities = {{.name = "f.max", .channel = "f"}};
  study.design = {.kind = kind, .count = 100};
  return study;
}

TEST(StudySummary, CountsViolationsExactly) {
  Study study = OneQuantity(DesignKind::kLatinHypercube);
  study.limits = {{.quantity = 0, .below = 98.0, .above = {}, .share = 0.03}};
  const StudySummary kept = SummariseStudy(study, {50.0}, Counting(100));
  EXPECT_EQ(kept.limits[0].violations, 3u);  // 98, 99, 100
  EXPECT_TRUE(kept.within_limits());
  EXPECT_NEAR(kept.limits[0].interval.upper, 0.08517605, 1e-8);
  study.limits[0].share = 0.0299;
  EXPECT_FALSE(SummariseStudy(study, {50.0}, Counting(100)).within_limits());
  study.limits[0] = {.quantity = 0, .below = {}, .above = 0.5, .share = 0.0};
  EXPECT_TRUE(SummariseStudy(study, {50.0}, Counting(100)).within_limits());
}

TEST(StudySummary, OnlyIndependentPointsHaveAnInterval) {
  for (const DesignKind kind : {DesignKind::kGrid, DesignKind::kList, DesignKind::kSaltelli}) {
    Study study = OneQuantity(kind);
    study.limits = {{.quantity = 0, .below = 98.0, .above = {}, .share = 0.03}};
    const StudySummary summary = SummariseStudy(study, {50.0}, Counting(99));
    EXPECT_TRUE(std::isnan(summary.limits[0].interval.upper));
    EXPECT_EQ(summary.limits[0].violations, 2u);
  }
}

TEST(StudySummary, WorstPointsAreFarthestBeyondTheLimitOrFromNominal) {
  Study study = OneQuantity(DesignKind::kList);
  const auto worst = [&] {
    return SummariseStudy(study, {90.0}, Counting(100)).quantities[0].worst;
  };
  ASSERT_EQ(worst().size(), kWorstPoints);
  EXPECT_EQ(worst()[0].value, 1.0);
  EXPECT_EQ(worst()[2].value, 3.0);
  study.limits = {{.quantity = 0, .below = 98.0, .above = {}, .share = 0.0}};
  EXPECT_EQ(worst()[0].value, 100.0);
  EXPECT_EQ(worst()[0].point, 99u);
  EXPECT_EQ(worst()[0].varied, std::vector<double>{100.0});
}

TEST(StudySummary, PercentilesAndMomentsAreThoseOfTheNumbers) {
  const auto q =
      SummariseStudy(OneQuantity(DesignKind::kList), {50.0}, Counting(101)).quantities[0];
  EXPECT_EQ(q.p5, 6.0);
  EXPECT_EQ(q.p50, 51.0);
  EXPECT_EQ(q.p95, 96.0);
  EXPECT_EQ(q.mean, 51.0);
  const auto few =
      SummariseStudy(OneQuantity(DesignKind::kList), {50.0}, Counting(19)).quantities[0];
  EXPECT_TRUE(std::isnan(few.p5) && std::isnan(few.p95)) << "of 19 values none is one in twenty";
  EXPECT_EQ(few.p50, 10.0);
  EXPECT_NEAR(q.deviation, std::sqrt(101.0 * 102.0 / 12.0), 1e-12);
}

TEST(StudySummary, PointsWithoutAValueAreReportedAndViolate) {
  Study study = OneQuantity(DesignKind::kList);
  study.limits = {{.quantity = 0, .below = 1000.0, .above = {}, .share = 0.0}};
  const PointRows rows = [](const std::function<void(const PointRow&)>& take) {
    take({.point = 0, .reason = {}, .varied = {1.0}, .values = {1.0}});
    take({.point = 1, .exit_code = 3, .reason = "stuck", .varied = {2.0}, .values = {kNan}});
  };
  const StudySummary summary = SummariseStudy(study, {1.0}, rows);
  EXPECT_EQ(summary.failed, 1u);
  EXPECT_EQ(summary.reasons.at("stuck"), 1u);
  EXPECT_EQ(summary.quantities[0].missing, 1u);
  EXPECT_EQ(summary.limits[0].violations, 1u);
  EXPECT_FALSE(summary.within_limits());
  EXPECT_EQ(summary.first_failed[0].point, 1u);
}

TEST(StudySummary, SwingsAreSortedByTheirWidth) {
  Study study = OneQuantity(DesignKind::kOneAtATime);
  study.factors.push_back({.name = "y", .key = "parameters.y", .axis = {0.0, Uniform{0.0, 1.0}}});
  const std::vector<double> values = {10.0, 9.0, 12.0, 2.0, 11.0};
  const PointRows rows = [&](const std::function<void(const PointRow&)>& take) {
    for (size_t i = 0; i < values.size(); ++i) {
      take({.point = i, .reason = {}, .varied = {0.0, 0.0}, .values = {values[i]}});
    }
  };
  const auto swings = SummariseStudy(study, {10.0}, rows).quantities[0].swings;
  ASSERT_EQ(swings.size(), 2u);
  EXPECT_EQ(swings[0].factor, 1u);
  EXPECT_EQ(swings[0].lowest, 2.0);
  EXPECT_EQ(swings[0].highest, 11.0);
  EXPECT_EQ(swings[1].lowest, 9.0);
  EXPECT_EQ(swings[1].highest, 12.0);
}

TEST(StudySummary, AFewMayHaveNoResultIfTheStudySaysSo) {
  Study study = OneQuantity(DesignKind::kSobol);
  study.limits = {{.quantity = 0, .below = 5.0, .above = {}}};
  const PointRows rows = [](const std::function<void(const PointRow&)>& take) {
    take({.point = 0, .reason = {}, .varied = {0.0}, .values = {1.0}});
    take({.point = 1, .exit_code = 3, .reason = "stuck", .varied = {0.0}, .values = {kNan}});
    take({.point = 2, .reason = {}, .varied = {0.0}, .values = {2.0}});
    take({.point = 3, .reason = {}, .varied = {0.0}, .values = {3.0}});
  };
  EXPECT_FALSE(SummariseStudy(study, {1.0}, rows).within_limits());
  study.missing = 0.25;
  const StudySummary few = SummariseStudy(study, {1.0}, rows);
  EXPECT_TRUE(few.within_limits());
  EXPECT_EQ(few.limits[0].count, 3u);
  study.missing = 0.24;
  EXPECT_FALSE(SummariseStudy(study, {1.0}, rows).within_limits());
  study.missing = 0.25;
  study.limits[0].below = 3.0;  // one that has a result violates it
  EXPECT_FALSE(SummariseStudy(study, {1.0}, rows).within_limits());
}

}  // namespace
}  // namespace mbv
