// Which bodies move with which drive, by hand.
#include "kinematics/command_rank.h"

#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "tests/mechanisms/two_sliders.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

double Speed(const DrivenTwists& twists, size_t driven, size_t body) {
  return twists.V_WB[driven][body].tail<3>().norm();
}

TEST(DrivenTwists, OfTwoSlidersInARowTheFirstCarriesTheSecond) {
  const DrivenTwists twists = TwistsOfDriven(test::DrivenSliders(), {true, true});
  EXPECT_NEAR(Speed(twists, 0, 1), 1.0, 1e-12);
  EXPECT_NEAR(Speed(twists, 0, 2), 1.0, 1e-12);
  EXPECT_NEAR(Speed(twists, 1, 1), 0.0, 1e-12);
  EXPECT_NEAR(Speed(twists, 1, 2), 1.0, 1e-12);
  EXPECT_EQ(twists.moved, (std::vector<bool>{false, true, true}));
}

TEST(DrivenTwists, APrescribedSliderIsNotMovedByDrives) {
  Mechanism m = test::DrivenSliders();
  m.drives.erase(m.drives.begin());
  m.prescribed = {{"base", 0}};
  const DrivenTwists twists = TwistsOfDriven(m, {true});
  EXPECT_EQ(twists.moved, (std::vector<bool>{false, false, true}));
  EXPECT_NEAR(Speed(twists, 1, 2), 1.0, 1e-12);  // the base moves both
}

TEST(DrivenTwists, TwoDrivesOnOneDofShareItAndLeaveThePrescribedBaseAtRest) {
  Mechanism m = test::DrivenSliders();
  m.drives = {m.drives[1], m.drives[1]};
  m.prescribed = {{"base", 0}};
  const DrivenTwists twists = TwistsOfDriven(m, {true, true});
  for (size_t d = 0; d < 2; ++d) {
    EXPECT_NEAR(Speed(twists, d, 1), 0.0, 1e-12);
    EXPECT_NEAR(Speed(twists, d, 2), 0.5, 1e-12);
  }
}

TEST(DrivenTwists, AFreeBodyGivesWayByItsInertia) {
  Mechanism m = test::DrivenSliders();
  m.bodies[1].mass = 3.0;  // pushed off by 1 kg
  const DrivenTwists twists = TwistsOfDriven(m, {false, true});
  EXPECT_NEAR(Speed(twists, 1, 1), 0.25, 1e-9);
  EXPECT_NEAR(Speed(twists, 1, 2), 0.75, 1e-9);
  EXPECT_NEAR(Speed(twists, 0, 2), 0.0, 1e-12);
}

TEST(DrivenTwists, ACrankTurnsItsLinkageAndNothingOfTheVehicle) {
  const LoadResult loaded = LoadModel(SourcePath("/models/vehicle_linkage/model.yaml"));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  const DrivenTwists twists = TwistsOfDriven(m, {true});
  const auto body = [&](const char* name) { return static_cast<size_t>(m.FindBody(name)); };
  EXPECT_LT(twists.V_WB[0][body("vehicle")].norm(), 1e-12);
  EXPECT_NEAR(twists.V_WB[0][body("crank")].head<3>().norm(), 1.0, 1e-12);
  EXPECT_NEAR(Speed(twists, 0, body("coupler")), m.ParameterValue("crank"), 1e-12);
  EXPECT_FALSE(twists.moved[body("vehicle")]);
  EXPECT_NEAR(Speed(twists, 1, body("rocker")), 1.0, 1e-12);
}

}  // namespace
}  // namespace mbv
