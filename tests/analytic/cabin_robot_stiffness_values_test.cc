// Stiffness of the cabin robot in numbers: compliances at two poses, the 50 loads, and what the
// printed limb does.
#include <gtest/gtest.h>

#include "tests/analytic/cabin_robot_stiffness_fixture.h"
#include "tests/support/allocation_counter.h"

namespace mbv::cabin_robot {
namespace {

/// The 50 loads: 0 … 1000 N and 0 … 1 N m from a 64-bit linear congruential generator.
std::vector<Vec6> Loads() {
  std::uint64_t x = 20250201;
  std::vector<Vec6> loads(50);
  for (Vec6& F : loads) {
    for (int c = 0; c < 6; ++c) {
      x = x * 6364136223846793005u + 1442695040888963407u;
      F[c] = static_cast<double>(x >> 11) * 0x1.0p-53 * (c < 3 ? 1000.0 : 1.0);
    }
  }
  return loads;
}

struct LoadSet {
  Vec3 low = Vec3::Constant(1e9), high = Vec3::Constant(-1e9), mean = Vec3::Zero();
};
LoadSet Range(const Mat6& C) {
  LoadSet range;
  for (const Vec6& F : Loads()) {
    const Vec3 d = 1e3 * (C * F).head<3>();
    range.low = range.low.cwiseMin(d.cwiseAbs());
    range.high = range.high.cwiseMax(d.cwiseAbs());
    range.mean += d / 50;
  }
  return range;
}

/// Largest difference over the loads per axis, over the axis' largest displacement; mean of the
/// vectors' relative differences.
struct LoadError {
  Vec3 axis = Vec3::Zero();
  double vector = 0.0;
};
LoadError Compare(const Mat6& C, const Mat6& truth) {
  LoadError error;
  Vec3 largest = Vec3::Zero();
  for (const Vec6& F : Loads()) {
    const Vec3 d = (C * F).head<3>(), t = (truth * F).head<3>();
    error.axis = error.axis.cwiseMax((d - t).cwiseAbs());
    largest = largest.cwiseMax(t.cwiseAbs());
    error.vector += (d - t).norm() / t.norm() / 50;
  }
  error.axis = error.axis.cwiseQuotient(largest);
  return error;
}

TEST(CabinStiffness, FirstPoseHasTheKnownCompliance) {
  const ToolStiffness tool = At(FirstPose());
  Vec6 diagonal;
  diagonal << 9.28e-8, 1.261e-7, 8.09e-8, 1.11e-6, 3.29e-7, 1.05e-6;
  for (int c = 0; c < 6; ++c) EXPECT_NEAR(tool.C(c, c) / diagonal[c], 1.0, 4e-3) << c;
  const Vec6 F = Loads().front();
  EXPECT_NEAR(F[0], 872.199362, 5e-7);
  EXPECT_NEAR(F[5], 0.332428, 5e-7);
  const Vec3 d = 1e3 * (tool.C * F).head<3>();
  EXPECT_NEAR(d[0], 0.078433, 5.1e-7);
  EXPECT_NEAR(d[1], 0.163127, 5.1e-7);
  EXPECT_NEAR(d[2], 0.127335, 5.1e-7);
}

TEST(CabinStiffness, LoadSetDisplacesAsInThePapersTable) {
  const Mat6 C = At(FirstPose()).C;
  const LoadSet range = Range(C);
  EXPECT_LT((range.low - Vec3(0.0001, 0.0075, 0.0054)).cwiseAbs().maxCoeff(), 5.1e-5);
  EXPECT_LT((range.high - Vec3(0.089, 0.174, 0.138)).cwiseAbs().maxCoeff(), 5.1e-4);
  EXPECT_LT((range.mean - Vec3(0.046, 0.092, 0.073)).cwiseAbs().maxCoeff(), 5.1e-4);
  // Correlation of Δy and Δz: one rotation dominates.
  double yy = 0, zz = 0, yz = 0;
  for (const Vec6& F : Loads()) {
    const Vec3 d = 1e3 * (C * F).head<3>() - range.mean;
    yy += d[1] * d[1];
    zz += d[2] * d[2];
    yz += d[1] * d[2];
  }
  EXPECT_NEAR(yz / std::sqrt(yy * zz), 0.976, 5.1e-4);
  // Moments of at most 1 N m do not matter.
  Vec3 moments = Vec3::Zero();
  for (const Vec6& F : Loads()) {
    moments = moments.cwiseMax(1e3 * (C.topRightCorner<3, 3>() * F.tail<3>()).cwiseAbs());
  }
  EXPECT_LT(moments.cwiseQuotient(range.high).maxCoeff(), 3.6e-3);
}

TEST(CabinStiffness, SecondPoseHasTheKnownCompliance) {
  Vec6 diagonal;
  diagonal << 1.46633e-7, 4.62551e-8, 1.26465e-7, 9.77971e-7, 3.27143e-7, 1.34999e-6;
  EXPECT_LT((At(SecondPose()).C.diagonal().cwiseQuotient(diagonal).array() - 1).abs().maxCoeff(),
            1e-5);
}

TEST(CabinStiffness, PrintedLimbMissesTheTrueOne) {  // (60), (61)
  const StiffnessParameters p = Paper();
  const PlanarState s = At(FirstPose()).planar;
  const LimbTruth truth = IntegratedLimb(p, s.alpha.p, s.epsilon.p);
  const Mat6 C = PrintedLimbCompliance(p, s.alpha.p + s.epsilon.p - 90 * kDeg);
  EXPECT_NEAR(C(0, 0) / truth.in_plane(0, 0), 3.00, 5.1e-3);
  EXPECT_NEAR(C(1, 1) / truth.in_plane(1, 1), 3.72, 5.1e-3);
  EXPECT_NEAR(C(1, 5) / truth.in_plane(1, 2), 2.84, 5.1e-3);
  EXPECT_NEAR(C(5, 1) / truth.in_plane(2, 1), 2.33, 5.1e-3);
  EXPECT_NEAR(C(5, 5) / truth.in_plane(2, 2), 1.49, 5.1e-3);
  EXPECT_NEAR(C(2, 2) / truth.out_of_plane(0, 0), 1.50, 5.1e-3);
  EXPECT_NEAR(C(3, 3) / truth.out_of_plane(1, 1), 1.40, 5.1e-3);
  EXPECT_NEAR(C(4, 4) / truth.out_of_plane(2, 2), 1.21, 5.1e-3);
  EXPECT_NEAR(C(1, 0) / truth.in_plane(1, 0), -441, 0.6);
  EXPECT_EQ(C(0, 1), 0.0);  // not symmetric
}

TEST(CabinStiffness, PrintedPlatformViolatesReciprocity) {
  const auto platform = [](const StiffnessPose& pose, LimbForm form) {
    return Mat6(At(pose, form).K_platform.inverse());
  };
  const Mat6 first = platform(FirstPose(), LimbForm::kAsPrinted);
  const Vec6 ratio =
      first.diagonal().cwiseQuotient(platform(FirstPose(), LimbForm::kCorrected).diagonal());
  EXPECT_NEAR(ratio.minCoeff(), 0.07, 5.1e-3);
  EXPECT_NEAR(ratio.maxCoeff(), 2.2, 0.051);
  EXPECT_NEAR((first - first.transpose()).cwiseAbs().maxCoeff() / first.cwiseAbs().maxCoeff(), 0.71,
              5.1e-3);
  const Mat6 second = platform(SecondPose(), LimbForm::kAsPrinted);
  EXPECT_LT(second(1, 1), 0.0);  // indefinite
  EXPECT_LT(second(4, 4), 0.0);
}

TEST(CabinStiffness, PrintedModelFailsThePapersOwnLimitOf15Percent) {
  const LoadError first = Compare(At(FirstPose(), LimbForm::kAsPrinted).C, At(FirstPose()).C);
  EXPECT_LT((first.axis - Vec3(0.39, 0.03, 0.22)).cwiseAbs().maxCoeff(), 5.1e-3);
  EXPECT_NEAR(first.vector, 0.16, 5.1e-3);
  const LoadError second = Compare(At(SecondPose(), LimbForm::kAsPrinted).C, At(SecondPose()).C);
  EXPECT_LT((second.axis - Vec3(1.22, 2.57, 1.92)).cwiseAbs().maxCoeff(), 5.1e-3);
  EXPECT_NEAR(second.vector, 1.95, 5.1e-3);
}

TEST(CabinStiffness, RetractedRailIsNotABeam) {
  StiffnessPose pose = FirstPose();
  pose.d5 = 0.0;
  const ToolStiffness tool = At(pose);
  EXPECT_TRUE(tool.C.allFinite());
  EXPECT_EQ(tool.elements[10].C.norm(), 0.0);
}

TEST(CabinStiffness, UnreachablePosesNameTheLink) {
  ToolStiffness tool;
  StiffnessPose pose = FirstPose();
  pose.Y = 0.6;
  const RunSummary summary = SolveStiffness(Paper(), pose, LimbForm::kCorrected, &tool);
  EXPECT_EQ(summary.stop, Stop::kUnreachable);
  EXPECT_EQ(summary.where, "link AB");
  EXPECT_FALSE(tool.K.allFinite());
}

TEST(CabinStiffness, EvaluatingAPoseTakesNoMemory) {
  const StiffnessParameters p = Paper();
  StiffnessPose pose = FirstPose();
  ToolStiffness tool;
  ASSERT_TRUE(SolveStiffness(p, pose, LimbForm::kCorrected, &tool).ok());
  const std::size_t before = AllocationCount();
  for (int k = 0; k < 100; ++k) {
    pose.X = 1e-5 * k;
    ASSERT_TRUE(SolveStiffness(p, pose, LimbForm::kCorrected, &tool).ok());
  }
  EXPECT_EQ(AllocationCount(), before);
}

}  // namespace
}  // namespace mbv::cabin_robot
