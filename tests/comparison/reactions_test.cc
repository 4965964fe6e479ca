// Reactions of joints, each on its own scale, and forces of prescribed joints.
#include <gtest/gtest.h>

#include "mechanism/channels.h"
#include "tests/comparison/carried.h"

namespace mbv {
namespace {

using synthetic::AddChannel;
using synthetic::Case;
using synthetic::OnVehicle;
using synthetic::Perturb;
using synthetic::Stretch;

// As Case, with a reaction of 1e-6 N at slide2 beside the 10 N of slide1; body b weighs nothing to
// speak of.
struct SmallReaction : Case {
  SmallReaction() {
    mechanism.bodies[2].mass = 1e-8;
    for (const Channel& channel : ReactionChannels(mechanism.joints[1])) {
      AddChannel(this, channel, channel.name.ends_with("fx") ? 1e-6 : 0.0);
    }
  }
};

const CheckResult& Check(const Comparison& comparison, const std::string& name) {
  const CheckResult* check = comparison.FindCheck("simulated_vs_analytic." + name);
  EXPECT_NE(check, nullptr) << name;
  static const CheckResult none;
  return check == nullptr ? none : *check;
}

TEST(Reactions, ASmallReactionIsJudgedOnItsOwnScale) {
  SmallReaction c;
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree) << c.Run().reason;
  Stretch(&c.simulated, "slide2.reaction.fx", 1.0 + 1e-4);
  const Comparison comparison = c.Run();
  EXPECT_TRUE(Check(comparison, "reaction_nrmse").pass);  // 1e-10 N of 6 N
  EXPECT_FALSE(Check(comparison, "reaction_nrmse_own").pass);
  EXPECT_EQ(Check(comparison, "reaction_nrmse_own").channel, "slide2.reaction.fx");
  EXPECT_NEAR(Check(comparison, "reaction_nrmse_own").value, 1e-4, 1e-7);
}

TEST(Reactions, AJointThatCarriesNothingIsJudgedByItsNeighbours) {
  Case c;
  for (const Channel& channel : ReactionChannels(c.mechanism.joints[1])) AddChannel(&c, channel, 0);
  Perturb(&c.simulated, "slide2.reaction.fy", 1e-14);  // round-off beside 1 kg
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);
  Perturb(&c.simulated, "slide2.reaction.fy", 1e-5);
  EXPECT_FALSE(Check(c.Run(), "reaction_nrmse_own").pass);
  EXPECT_TRUE(Check(c.Run(), "reaction_nrmse_own").floored);
}

TEST(BaseForce, ForcesOfPrescribedJointsAreCompared) {
  OnVehicle c(true);
  AddChannel(&c, {"vehicle.force", "N", ""}, (1e7 + 2.0) * 9.81);
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree) << c.Run().reason;
  EXPECT_EQ(Check(c.Run(), "base_force").value, 0.0);
  Stretch(&c.simulated, "vehicle.force", 1.0 + 2e-9);  // twice the limit
  EXPECT_FALSE(Check(c.Run(), "base_force").pass);
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
}

TEST(BaseForce, NanNeverPasses) {
  OnVehicle c(true);
  AddChannel(&c, {"vehicle.force", "N", ""}, 1.0);
  c.simulated.values(5, c.simulated.Find("vehicle.force")) = kNan;
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
}

}  // namespace
}  // namespace mbv
