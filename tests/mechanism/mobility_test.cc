// Mobility counts that can be checked by hand.
#include "mechanism/mobility.h"

#include <gtest/gtest.h>

#include "mechanism/load_model.h"
#include "tests/simulation/test_mechanisms.h"
#include "tests/source_dir.h"

namespace mbv {
namespace {

using ::mbv::testing::MakeFourBar;

TEST(Mobility, APlanarFourBarMovesAlthoughKutzbachSaysMinusTwo) {
  const Mobility mobility = AnalyseMobility(MakeFourBar());
  EXPECT_EQ(mobility.body_coordinates, 18);
  EXPECT_EQ(mobility.constraint_rows, 20);
  EXPECT_EQ(mobility.constraint_rank, 17);
  EXPECT_EQ(mobility.kutzbach, -2);
  EXPECT_EQ(mobility.freedoms, 1);
  EXPECT_EQ(mobility.redundant, 3);
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_TRUE(mobility.drives_determine_motion);
}

TEST(Mobility, TheFourBarsMotorIsUniqueAlthoughNoHingeReactionIs) {
  const Mobility mobility = AnalyseMobility(MakeFourBar());
  EXPECT_TRUE(mobility.drive_forces_unique);
  EXPECT_EQ(mobility.joints_not_unique, (std::vector<std::string>{"A", "B", "D", "C"}));
}

TEST(Mobility, TwoMotorsOnOneFreedomFightEachOther) {
  Mechanism m = MakeFourBar();
  m.drives.push_back({.name = "second", .kind = JointDrive{2, 0}, .range = {}});
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_FALSE(mobility.drive_forces_unique);
  EXPECT_EQ(mobility.drives_not_unique, (std::vector<std::string>{"motor", "second"}));
}

TEST(Mobility, WithoutItsMotorTheFourBarIsFree) {
  Mechanism m = MakeFourBar();
  m.drives.clear();
  const Mobility mobility = AnalyseMobility(m);
  EXPECT_EQ(mobility.undriven, 1);
  EXPECT_FALSE(mobility.drives_determine_motion);
}

TEST(Mobility, ABallRemovesTwoOfTheThreeRedundancies) {
  const Mobility mobility = AnalyseMobility(MakeFourBar(JointKind::kSpherical));
  EXPECT_EQ(mobility.kutzbach, 0);
  EXPECT_EQ(mobility.freedoms, 1);
  EXPECT_EQ(mobility.redundant, 1);
}

TEST(Mobility, AnIsostaticRuleThatFreesALinkIsFoundOut) {
  Mechanism m = MakeFourBar(JointKind::kRevolute, true);
  EXPECT_TRUE(AnalyseMobility(m).isostatic_rule_sound);
  m.joints[1].transmits_force_only = true;  // a coupler between two balls can spin
  EXPECT_FALSE(AnalyseMobility(m).isostatic_rule_sound);
}

TEST(Mobility, TheStabilizingPlatformHasTwoRedundantConstraintsPerLimb) {
  LoadResult loaded = LoadModel(SourcePath("/models/stabilizing_platform/model.yaml"));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mobility mobility = AnalyseMobility(*loaded.mechanism);
  EXPECT_EQ(mobility.redundant, 6);
  EXPECT_EQ(mobility.freedoms, 3 + 6);  // the ship's and the platform's
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_TRUE(mobility.isostatic_rule_sound);
  EXPECT_TRUE(mobility.drive_forces_unique);
  EXPECT_TRUE(mobility.joints_not_unique.empty());  // by the isostatic rule
  EXPECT_GT(mobility.smallest_kept, 1e6 * mobility.largest_dropped);

  // Without the rule the five joints of each limb's planar loop share two self-stresses.
  for (Joint& joint : loaded.mechanism->joints) joint.transmits_force_only = false;
  const Mobility without = AnalyseMobility(*loaded.mechanism);
  EXPECT_EQ(without.joints_not_unique.size(), 15u);
  EXPECT_TRUE(without.drive_forces_unique);
}

TEST(Mobility, TheTripodHasThreeFreedomsAndNoRedundancy) {
  const LoadResult loaded = LoadModel(SourcePath("/models/spr_tripod/model.yaml"));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mobility mobility = AnalyseMobility(*loaded.mechanism);
  EXPECT_EQ(mobility.freedoms, 3);
  EXPECT_EQ(mobility.redundant, 0);
  EXPECT_EQ(mobility.undriven, 0);
}

}  // namespace
}  // namespace mbv
