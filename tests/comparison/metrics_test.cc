#include "comparison/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mbv {
namespace {

TEST(ErrorSum, RatiosOfAHandCheckableSignal) {
  ErrorSum sum;
  sum.Add(0.3, 3.0, 0.0, "a");
  sum.Add(-0.4, -4.0, 0.1, "a");
  EXPECT_DOUBLE_EQ(sum.rms_truth(), std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(sum.Nrmse(), 0.1);
  EXPECT_DOUBLE_EQ(sum.MaxRelative(), 0.1);
  EXPECT_DOUBLE_EQ(sum.worst_time_s(), 0.1);
}

TEST(ErrorSum, ANanAtAnyPlaceStays) {
  for (const int at : {0, 1, 2}) {
    ErrorSum sum;
    for (int i = 0; i < 3; ++i) sum.Add(i == at ? kNan : 0.1, 1.0, i, "a");
    EXPECT_TRUE(std::isnan(sum.Nrmse()));
    EXPECT_TRUE(std::isnan(sum.MaxRelative()));
    ErrorSum merged;
    merged.Add(0.1, 1.0, 0.0, "b");
    merged.Merge(sum);
    EXPECT_TRUE(std::isnan(merged.MaxRelative()));
  }
}

TEST(ErrorSum, NothingMeasuredIsNan) {
  EXPECT_TRUE(std::isnan(ErrorSum().Nrmse()));
  EXPECT_TRUE(std::isnan(ErrorSum().MaxRelative()));
}

TEST(ErrorSum, AFloorScalesSignalsAtRest) {
  ErrorSum sum;
  sum.Add(1e-6, 0.0, 0.0, "a");
  EXPECT_TRUE(std::isinf(sum.Nrmse()));
  EXPECT_DOUBLE_EQ(sum.Nrmse(1e-3), 1e-3);
}

TEST(KeepWorst, ANanBeatsEveryNumber) {
  Measured worst;
  KeepWorst(&worst, 1.0, 0.0, "a");
  KeepWorst(&worst, kNan, 1.0, "b");
  KeepWorst(&worst, 5.0, 2.0, "c");
  EXPECT_TRUE(std::isnan(worst.value));
  EXPECT_EQ(worst.channel, "b");
}

TEST(AngleDifference, IsTakenModuloATurn) {
  const double turn = 2.0 * std::numbers::pi;
  EXPECT_NEAR(AngleDifference(3.1, -3.1), 6.2 - turn, 4 * kEps);
  EXPECT_NEAR(AngleDifference(0.2 + 3 * turn, 0.1), 0.1, 32 * kEps);
}

TEST(MatchingDigits, CountsDecimals) {
  EXPECT_DOUBLE_EQ(MatchingDigits(1e-7), 7.0);
  EXPECT_DOUBLE_EQ(MatchingDigits(0.0), 16.0);
  EXPECT_DOUBLE_EQ(MatchingDigits(5.0), 0.0);
  EXPECT_TRUE(std::isnan(MatchingDigits(kNan)));
}

TEST(AlignSamples, FindsTimesThatAreEqualWithinANanosecond) {
  Trace a, b;
  a.time_s = {0.0, 0.1, 0.2, 0.3};
  b.time_s = {0.1 + 1e-12, 0.25, 0.3};
  const CommonSamples samples = AlignSamples(a, b);
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_EQ(samples[0], (std::pair<Eigen::Index, Eigen::Index>{1, 0}));
  EXPECT_EQ(samples[1], (std::pair<Eigen::Index, Eigen::Index>{3, 2}));
}

}  // namespace
}  // namespace mbv
