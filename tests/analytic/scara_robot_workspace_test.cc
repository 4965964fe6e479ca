// Workspace of the SCARA robot: the paper's cylinder, dead points, volume.
#include "analytic/scara_robot/workspace.h"

#include <gtest/gtest.h>

#include "tests/analytic/scara_robot_fixture.h"

namespace mbv::scara_robot {
namespace {

constexpr int kLayers = 14, kRings = 10, kSpokes = 36;  // layers 10 mm apart

CylinderCheck PaperCylinder(const Parameters& p, double phi_deg) {
  return CheckCylinder(p, Limits{}, CylinderSpace{}, phi_deg * kDeg, kLayers, kRings, kSpokes);
}

TEST(ScaraWorkspace, LevelCylinderIsReachableEverywhere) {
  const CylinderCheck check = PaperCylinder(PaperParameters(), 0);
  EXPECT_TRUE(check.complete);
  EXPECT_EQ(check.poses.size(), kLayers * (1u + kRings * kSpokes));
  // It touches the dead points of limbs 1 and 2 at (50, 0) and (0, 50) mm on its top.
  EXPECT_NEAR(check.V_min, 0.0, 1e-6);
  EXPECT_NEAR(check.X_at_V_min[2], -0.100, 1e-15);
  EXPECT_NEAR(std::max(check.X_at_V_min[0], check.X_at_V_min[1]), 0.050, 1e-12);
}

TEST(ScaraWorkspace, CylinderAtFortyFiveDegreesIsIncompleteAtTheBottom) {
  for (const double phi_deg : {-45.0, 45.0}) {
    const CylinderCheck check = PaperCylinder(PaperParameters(), phi_deg);
    EXPECT_FALSE(check.complete);
    for (size_t layer = 0; layer < check.layer_z.size(); ++layer) {
      if (check.layer_z[layer] >= -0.190 - 1e-9) {
        EXPECT_EQ(check.layer_reached[layer], 1.0) << check.layer_z[layer];
      }
    }
    // 83 % of a polar sample of the bottom disc; a grid of other density differs by some per cent.
    EXPECT_NEAR(check.layer_reached.back(), 0.83, 0.05);
    const CylinderSpace inner{.radius = 0.079};
    EXPECT_TRUE(
        CheckCylinder(PaperParameters(), Limits{}, inner, phi_deg * kDeg, kLayers, kRings, kSpokes)
            .complete);
  }
}

TEST(ScaraWorkspace, PrintedShortRodLeavesTheBottomOutOfReach) {
  Parameters printed = PaperParameters();
  printed.e = -printed.e;
  const CylinderCheck check = PaperCylinder(printed, 0);
  EXPECT_EQ(check.layer_reached.back(), 0.0);
  EXPECT_NEAR(check.layer_z[9], -0.190, 1e-12);
  EXPECT_NEAR(check.layer_reached[9], 0.32, 0.05);
}

TEST(ScaraWorkspace, LimitsTakePosesAwayAndNameTheirLimb) {
  const Parameters p = PaperParameters();
  const Vec4 X = PoseOf(-50, -50, -150, 0);
  const PoseCheck free = CheckPose(p, Limits{}, X);
  ASSERT_EQ(free.reach, Reach::kReachable);
  EXPECT_EQ(free.limb, -1);
  const PoseCheck motor = CheckPose(p, Limits{.theta_max = 60 * kDeg}, X);
  EXPECT_EQ(motor.reach, Reach::kMotorRange);
  EXPECT_EQ(motor.limb, 0);
  EXPECT_NEAR(motor.excess, 5.704811 * kDeg, 1e-6 * kDeg);
  const PoseCheck shear = CheckPose(p, Limits{.shear_max = free.shear - 0.01}, X);
  EXPECT_EQ(shear.reach, Reach::kShear);
  EXPECT_NEAR(shear.excess, 0.01, 1e-12);
}

TEST(ScaraWorkspace, SliceShowsTheSingularLinesThroughTheCentre) {
  const std::vector<PoseCheck> map = MapSlice(PaperParameters(), Limits{}, -0.165, 0, 0.06, 5);
  ASSERT_EQ(map.size(), 25u);
  EXPECT_LT(map[12].singularity.s_min, kRankDeficient);
  // The determinant has one sign on a diagonal and the other on the other one.
  EXPECT_GT(map[0].singularity.det * map[24].singularity.det, 0.0);
  EXPECT_LT(map[0].singularity.det * map[4].singularity.det, 0.0);
  EXPECT_GT(map[0].singularity.s_min, kNearlySingular);
}

TEST(ScaraWorkspace, VolumeOfASphericalShellIsFound) {
  // Without platform, drop and base offset and with all limbs equal, a pose is reachable by an
  // arm in a radial plane and its rod; at R = r all four motors meet the same torus-like region
  // only in part, so the test bounds: it holds the small cylinder and lies in the box.
  const Parameters p = PaperParameters();
  const Volume coarse = EstimateVolume(p, Limits{}, 0, Box3{}, 16, 31);
  const Volume fine = EstimateVolume(p, Limits{}, 0, Box3{}, 32, 32);
  EXPECT_LT(std::abs(coarse.volume_m3 - fine.volume_m3),
            coarse.uncertainty_m3 + fine.uncertainty_m3);
  EXPECT_LT(fine.uncertainty_m3, coarse.uncertainty_m3 / 2);
  const double cylinder = std::numbers::pi * 0.1 * 0.1 * 0.13;
  EXPECT_GT(fine.volume_m3, cylinder);
  EXPECT_LT(fine.volume_m3, (Box3{}.high - Box3{}.low).prod());
  EXPECT_GT(fine.fraction_usable, 0.0);
  EXPECT_LT(fine.fraction_usable, 1.0);
}

TEST(ScaraWorkspace, VolumeIsReproducible) {
  const Parameters p = PaperParameters();
  const Volume first = EstimateVolume(p, Limits{}, 0.1, Box3{}, 8, 33);
  const Volume second = EstimateVolume(p, Limits{}, 0.1, Box3{}, 8, 33);
  EXPECT_EQ(first.volume_m3, second.volume_m3);
  EXPECT_EQ(first.samples, 1024);
}

}  // namespace
}  // namespace mbv::scara_robot
