// The mobility report: by loop, by name, and at a singular home.
#include "kinematics/mobility.h"

#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using Names = std::vector<std::string>;

Mechanism Shipped(const std::string& name) {
  const LoadResult loaded = LoadModel(std::string(kSourceDir) + "/models/" + name + "/model.yaml");
  EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  return *loaded.mechanism;
}

// A four-bar linkage of these lengths; guesses in degrees.
Mechanism FourBar(double crank, double coupler, double rocker, double a, double b, double d) {
  const auto body = [](const char* name, double length) {
    return "  " + std::string(name) + ": {mass: 1, inertia: [1, 1, 1], frames: {end: [" +
           std::to_string(length) + ", 0, 0]}}\n";
  };
  const LoadResult loaded = LoadModelText(
      "name: m\nworld: {frames: {D: [0.5, 0, 0]}}\nbodies:\n" + body("crank", crank) +
          body("coupler", coupler) + body("rocker", rocker) +
          "joints:\n  A: {kind: revolute, parent: world, child: crank, axis: z, guess_deg: " +
          std::to_string(a) +
          "}\n  B: {kind: revolute, parent: crank.end, child: coupler, axis: z, guess_deg: " +
          std::to_string(b) +
          "}\n  C: {kind: revolute, parent: rocker.end, child: coupler.end, axis: z, closure: "
          "true}\n  D: {kind: revolute, parent: world.D, child: rocker, axis: z, guess_deg: " +
          std::to_string(d) + "}\ndrives: {motor: {kind: joint, joint: A}}\n",
      "m.yaml");
  EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  return *loaded.mechanism;
}

TEST(MobilityReport, APlanarFourBarHasThreeRedundantConstraintsInOneLoop) {
  const MobilityReport report = ReportMobility(Shipped("four_bar"));
  EXPECT_EQ(report.dofs(), 1);
  EXPECT_EQ(report.nearby.size(), 5u);
  EXPECT_FALSE(report.home_singular());
  ASSERT_EQ(report.loops.size(), 1u);
  EXPECT_EQ(report.loops[0].joint_dofs, 4);
  EXPECT_EQ(report.loops[0].screw_rank, 3);
  ASSERT_EQ(report.redundant.size(), 1u);
  EXPECT_EQ(report.redundant[0].count, 3);
  EXPECT_EQ(report.redundant[0].joints, (Names{"A", "B", "C", "D"}));
  // Forces along the axes and bending moments of the pins fight each other; forces in the plane and
  // the motor's torque are definite.
  ASSERT_EQ(report.home.reactions_not_unique.size(), 4u);
  for (const UndeterminedReaction& reaction : report.home.reactions_not_unique) {
    EXPECT_EQ(reaction.components, (Names{"fz", "mx", "my"})) << reaction.joint;
  }
  EXPECT_TRUE(report.home.drives_not_unique.empty());
}

TEST(MobilityReport, TheSpatialSliderCrankIsStaticallyDeterminate) {
  const MobilityReport report = ReportMobility(Shipped("slider_crank"));
  EXPECT_EQ(report.dofs(), 1);
  ASSERT_EQ(report.loops.size(), 1u);
  EXPECT_EQ(report.loops[0].joint_dofs, 7);  // Grübler: 7 - 6 = 1
  EXPECT_EQ(report.loops[0].screw_rank, 6);
  EXPECT_TRUE(report.redundant.empty());
  EXPECT_TRUE(report.undetermined.empty());
  EXPECT_TRUE(report.home.reactions_not_unique.empty());
}

TEST(MobilityReport, ABallAtBothEndsLetsTheRodSpin) {
  Mechanism m = Shipped("slider_crank");
  m.joints[m.FindJoint("C")].kind = JointKind::kSpherical;
  // A round rod: nothing turns it.
  const MobilityReport idle = ReportMobility(m);
  EXPECT_EQ(idle.dofs(), 1);
  EXPECT_EQ(idle.home.undriven, 0);
  EXPECT_EQ(idle.home.idle_spins, (Names{"rod"}));
  EXPECT_TRUE(idle.free_bodies.empty());
  // One that its weight turns.
  m.bodies[static_cast<size_t>(m.FindBody("rod"))].p_BoBcm_B += Vec3(1e-3, 2e-3, 3e-3);
  const MobilityReport report = ReportMobility(m);
  EXPECT_EQ(report.dofs(), 2);
  EXPECT_EQ(report.home.undriven, 1);
  EXPECT_FALSE(report.drives_singular());
  EXPECT_EQ(report.free_bodies, (Names{"rod"}));
  EXPECT_TRUE(report.home.idle_spins.empty());
  ASSERT_EQ(report.spins_not_idle.size(), 1u);
  EXPECT_NE(report.spins_not_idle[0].find("rod: the centre of mass of rod lies"),
            std::string::npos);
}

TEST(MobilityReport, TheStewartPlatformHasSixDegreesOfFreedomAndNothingRedundant) {
  const MobilityReport report = ReportMobility(Shipped("stewart"));
  EXPECT_EQ(report.dofs(), 6);
  EXPECT_EQ(report.loops.size(), 6u);
  EXPECT_TRUE(report.redundant.empty());
  EXPECT_TRUE(report.home.reactions_not_unique.empty());
}

TEST(MobilityReport, RedundancyIsSharedOutAmongTheLoopsThatHaveIt) {
  const Mechanism m = Shipped("stabilizing_platform");
  const MobilityReport report = ReportMobility(m);
  ASSERT_EQ(report.redundant.size(), 3u);  // one planar loop per limb
  int count = 0;
  for (const StressGroup& group : report.redundant) {
    EXPECT_EQ(group.joints.size(), 5u);
    count += group.count;
  }
  EXPECT_EQ(count, report.home.redundant);
  EXPECT_TRUE(report.undetermined.empty());  // by the isostatic rule
}

TEST(MobilityReport, AFoldedLinkageIsRecognisedAsASingularHome) {
  // A parallelogram that lies flat on the ground line: it can rise as a parallelogram or as an
  // antiparallelogram, two DOFs at home, one nearby.
  const MobilityReport flat = ReportMobility(FourBar(0.2, 0.5, 0.2, 0, 0, 0));
  EXPECT_EQ(flat.home.dofs, 2);
  EXPECT_EQ(flat.dofs(), 1);
  EXPECT_TRUE(flat.home_singular());
  const MobilityReport raised = ReportMobility(FourBar(0.2, 0.5, 0.2, 60, -60, 60));
  EXPECT_FALSE(raised.home_singular());
}

TEST(MobilityReport, ADriveInItsDeadCentreHoldsNothingAtHomeOnly) {
  // Crank and coupler in line at atan(3/4), rocker upright: a 3-4-5 triangle scaled to a ground of
  // 0.5. A drive on the rocker has no hold there.
  const double angle_deg = 36.86989764584402;
  Mechanism m = FourBar(0.1875, 0.4375, 0.375, angle_deg, 0, 90);
  m.drives[0].kind = JointDrive{m.FindJoint("D"), 0};
  const MobilityReport report = ReportMobility(m);
  EXPECT_EQ(report.dofs(), 1);
  EXPECT_EQ(report.home.undriven, 1);
  EXPECT_EQ(report.undriven(), 0);
  EXPECT_TRUE(report.drives_singular());
  EXPECT_FALSE(report.home_singular());
}

TEST(MobilityReport, TwoMotorsOnOneDofAreNamedTogether) {
  Mechanism m = Shipped("four_bar");
  m.drives.push_back({.name = "second", .kind = JointDrive{m.FindJoint("D"), 0}, .range = {}});
  const MobilityReport report = ReportMobility(m);
  ASSERT_FALSE(report.undetermined.empty());
  int count = 0;
  Names drives;
  for (const StressGroup& group : report.undetermined) {
    count += group.count;
    drives.insert(drives.end(), group.drives.begin(), group.drives.end());
  }
  EXPECT_EQ(count, 4);  // the three of the plane, and one by the motors
  EXPECT_EQ(drives, (Names{"motor", "second"}));
}

}  // namespace
}  // namespace mbv
