#include "math/trace.h"

#include <gtest/gtest.h>

#include <set>

namespace mbv {
namespace {

TEST(Channel, NamesAreThoseOfTheFiles) {
  EXPECT_EQ(ChannelName(Quantity::kForce, "limb1.drive"), "limb1.drive.force");
  EXPECT_EQ(ChannelName(Quantity::kBaseForce, "ship"), "ship.force");
  EXPECT_EQ(ChannelName(Quantity::kPose, "platform", 5), "platform.yaw");
  EXPECT_EQ(ChannelName(Quantity::kPoseVelocity, "platform", 0), "platform.x.velocity");
  EXPECT_EQ(ChannelName(Quantity::kReaction, "hinge", 2), "hinge.reaction.fz");
  EXPECT_EQ(ChannelName(Quantity::kReaction, "hinge"), "hinge.reaction");
  EXPECT_EQ(ChannelName(Quantity::kEnergyRate), "power.energy_rate");
  EXPECT_EQ(ChannelName(Quantity::kLoadWork), "loads.work");
}

TEST(Channel, EachQuantityHasItsName) {
  std::set<std::string> names;
  for (int q = 1; q < static_cast<int>(Quantity::kCount_); ++q) {
    const auto quantity = static_cast<Quantity>(q);
    // Drives, prescribed joints and coordinates of joints share words and never a name.
    const bool base = quantity == Quantity::kBaseForce || quantity == Quantity::kBaseForceBand ||
                      quantity == Quantity::kBaseWork;
    const bool joint = quantity == Quantity::kJointPosition ||
                       quantity == Quantity::kJointVelocity ||
                       quantity == Quantity::kJointAcceleration;
    const std::string subject = base ? "base" : joint ? "joint" : "one";
    EXPECT_TRUE(names.insert(ChannelName(quantity, subject, 0)).second) << q;
  }
}

TEST(Channel, ItKnowsWhatItIs) {
  const Channel channel = MakeChannel(Quantity::kReaction, "N m", "hinge", "hinge", 4);
  EXPECT_EQ(channel.name, "hinge.reaction.my");
  EXPECT_EQ(channel.subject, "hinge");
  EXPECT_EQ(SignalWord(channel), "my");
  EXPECT_EQ(SignalWord(MakeChannel(Quantity::kVelocity, "m/s", "d1")), "velocity");
  EXPECT_EQ(SignalWord(MakeChannel(Quantity::kPose, "rad", "plate", "world", 3)), "roll");
  EXPECT_EQ(MakeChannel(Quantity::kKineticEnergy).unit, "J");
  const Channel own{"linkage.alpha", "rad", ""};
  EXPECT_EQ(own.quantity, Quantity::kOwn);
  EXPECT_EQ(SignalWord(own), "linkage.alpha");
}

TEST(Channel, ColumnsAreCountedByQuantity) {
  const ChannelColumns columns(
      {MakeChannel(Quantity::kPosition, "m", "a"), MakeChannel(Quantity::kForce, "N", "a"),
       MakeChannel(Quantity::kPosition, "m", "b"), MakeChannel(Quantity::kForce, "N", "b"),
       MakeChannel(Quantity::kInputPower)});
  EXPECT_EQ(columns(Quantity::kPosition, 1), 2);
  EXPECT_EQ(columns(Quantity::kForce, 0), 1);
  EXPECT_EQ(columns(Quantity::kInputPower), 4);
  EXPECT_TRUE(columns.Has(Quantity::kForce));
  EXPECT_FALSE(columns.Has(Quantity::kReaction));
}

}  // namespace
}  // namespace mbv
