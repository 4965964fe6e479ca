// The time that is left, by what has been done so far.
#include "base/worker_pool.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

TEST(TimeLeft, GoesOnAsFastAsSoFar) {
  TimeLeft left;
  EXPECT_EQ(left.Text(0.0, 100.0), "");
  EXPECT_EQ(left.Text(0.05, 101.0), "");  // too early to report
  EXPECT_EQ(left.Text(0.1, 140.0), "about 6 min left");
  EXPECT_EQ(left.Text(0.5, 200.0), "about 2 min left");
  EXPECT_EQ(left.Text(0.8, 260.0), "about 40 s left");
  EXPECT_EQ(left.Text(0.999, 300.0), "");  // nearly done
}

// What was done before the first call took no time here; the next stage counts anew.
TEST(TimeLeft, CountsFromTheFirstCallAndFromEachFall) {
  TimeLeft left;
  EXPECT_EQ(left.Text(0.5, 0.0), "");
  EXPECT_EQ(left.Text(0.75, 60.0), "about 60 s left");
  EXPECT_EQ(left.Text(0.0, 61.0), "");
  EXPECT_EQ(left.Text(0.1, 71.0), "about 90 s left");
}

TEST(TimeLeft, IsReportedInSuitableUnits) {
  EXPECT_EQ(TimeText(12.4), "12 s");
  EXPECT_EQ(TimeText(180.0), "3 min");
  EXPECT_EQ(TimeText(9000.0), "2.5 h");
}

}  // namespace
}  // namespace mbv
