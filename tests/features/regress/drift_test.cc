// Drift: what is reported, and what is only noise.
#include "features/regress/golden.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace mbv {
namespace {

std::vector<PastValue> Steady(double value, long runs) {
  std::vector<PastValue> past;
  for (long run = 1; run <= runs; ++run) past.push_back({run, value, true, false});
  return past;
}

TEST(Drift, TenTimesWorseIsReportedWithItsBaseline) {
  const auto found = FindDrift(Steady(2e-9, 10), 2e-8);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->baseline, 2e-9, 1e-18);
  EXPECT_NEAR(found->threshold, 2e-8, 1e-17);
  EXPECT_EQ(found->good_runs, 10U);
  EXPECT_EQ(found->since_run, 0);
}

TEST(Drift, LessThanTenTimesWorseIsNot) { EXPECT_FALSE(FindDrift(Steady(2e-9, 10), 1.99e-8)); }

TEST(Drift, BetterIsNot) { EXPECT_FALSE(FindDrift(Steady(2e-9, 10), 2e-12)); }

TEST(Drift, MovementNearRoundoffIsNot) {
  EXPECT_FALSE(FindDrift(Steady(1e-16, 10), 9e-13));
  EXPECT_TRUE(FindDrift(Steady(1e-16, 10), 1.1e-12));
}

TEST(Drift, FewerThanThreeGoodRunsGiveNoBaseline) {
  EXPECT_FALSE(FindDrift(Steady(2e-9, 2), 1e-3));
  EXPECT_TRUE(FindDrift(Steady(2e-9, 3), 1e-3));
}

TEST(Drift, FailedRunsAreNoBaseline) {
  std::vector<PastValue> past = Steady(2e-9, 3);
  for (long run = 4; run < 20; ++run) past.push_back({run, 1e-2, false, false});
  EXPECT_TRUE(FindDrift(past, 2e-8));
}

TEST(Drift, OneWildRunDoesNotMoveTheBaseline) {
  std::vector<PastValue> past = Steady(2e-9, 6);
  past[2].value = 1e-4;
  EXPECT_TRUE(FindDrift(past, 2e-8));
}

TEST(Drift, KeepsTellingSinceWhichRunHoweverLongItLasts) {
  std::vector<PastValue> past = Steady(2e-9, 5);
  for (long run = 6; run < 60; ++run) past.push_back({run, 3e-8, true, true});
  past[30].good = false;  // a failed regression in between
  const auto found = FindDrift(past, 3e-8);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->since_run, 6);
  EXPECT_NEAR(found->baseline, 2e-9, 1e-18);
}

TEST(Drift, ABetterRunEndsTheStretch) {
  std::vector<PastValue> past = Steady(2e-9, 5);
  past.push_back({6, 3e-8, true, true});
  past.push_back({7, 2e-9, true, false});
  past.push_back({8, 3e-8, true, true});
  EXPECT_EQ(FindDrift(past, 3e-8)->since_run, 8);
}

TEST(Drift, ANumberThatIsNoneIsNotDrift) {
  EXPECT_FALSE(FindDrift(Steady(2e-9, 10), NAN));
  EXPECT_FALSE(FindDrift({}, 1.0));
}

// Log-normal noise of a factor 2 (one standard deviation) over 2000 regressions: never reported.
TEST(Drift, NoiseIsNeverReported) {
  std::mt19937_64 random(20260131);
  std::normal_distribution<double> exponent(0.0, std::log10(2.0));
  std::vector<PastValue> past;
  int reported = 0;
  for (long run = 1; run <= 2000; ++run) {
    const double now = 1e-9 * std::pow(10.0, exponent(random));
    const bool drifted = FindDrift(past, now).has_value();
    reported += drifted ? 1 : 0;
    past.push_back({run, now, true, drifted});
  }
  EXPECT_EQ(reported, 0);
  EXPECT_TRUE(FindDrift(past, 1e-6)) << "noise must not hide a thousandfold loss";
}

}  // namespace
}  // namespace mbv
