#include "verify/ranges.h"

#include <gtest/gtest.h>

#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

TEST(Ranges, TheWorstSampleOfEachDriveIsReported) {
  Mechanism mechanism = synthetic::TwoSliders();
  mechanism.drives[0].range = {-0.4, 1.0};  // moves ±0.5
  mechanism.drives[1].range = {-0.3, 0.3};  // moves ±0.2
  const auto violations = DriveViolations(mechanism, synthetic::ExactTrace("analytic"));
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].Text(),
            "at t = 0.75 s drive d1 needs -0.5 m, its range is -0.4 … 1 m (0.1 m beyond)");
  const RunSummary summary = LimitSummary(violations);
  EXPECT_EQ(summary.stop, Stop::kLimit);
  EXPECT_DOUBLE_EQ(summary.time_s, 0.75);
  EXPECT_NEAR(summary.amount, 0.1, 1e-15);
}

TEST(Ranges, TouchingALimitIsNotAViolation) {
  Mechanism mechanism = synthetic::TwoSliders();
  mechanism.drives[0].range = {-0.5, 0.5};
  EXPECT_TRUE(DriveViolations(mechanism, synthetic::ExactTrace("analytic")).empty());
  mechanism.drives[0].range = {-0.5, 0.5 - 1e-8};
  EXPECT_EQ(DriveViolations(mechanism, synthetic::ExactTrace("analytic")).size(), 1u);
}

TEST(Ranges, JointsAreWatchedAtTheSimulatedPoses) {
  Mechanism mechanism = synthetic::TwoSliders();
  mechanism.joints[1].range[0] = {-1.0, 0.2};
  const auto poses = [](double second) {
    std::vector<Pose> X_WB(3, Pose::Identity());
    X_WB[1].translation().z() = 0.1;
    X_WB[2].translation().z() = 0.1 + second;  // slide2 carries b along z
    return X_WB;
  };
  const auto violations =
      JointViolations(mechanism, {0.0, 0.5, 1.0}, {poses(0.1), poses(0.27), poses(0.25)});
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].what, "joint slide2");
  EXPECT_DOUBLE_EQ(violations[0].time_s, 0.5);
  EXPECT_NEAR(violations[0].amount, 0.07, 1e-12);
}

}  // namespace
}  // namespace mbv
