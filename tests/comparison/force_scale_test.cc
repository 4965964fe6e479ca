// Floors scale with what the compared drives carry, and show where they act.
#include "comparison/force_scale.h"

#include <gtest/gtest.h>

#include "tests/comparison/carried.h"

namespace mbv {
namespace {

using synthetic::AddChannel;
using synthetic::Bend;
using synthetic::Case;
using synthetic::OnVehicle;
using synthetic::Stretch;

bool CheckFails(const Comparison& comparison, const std::string& check) {
  const CheckResult* found = comparison.FindCheck(check);
  return found != nullptr && found->limit && !found->pass;
}

TEST(ForceScale, APrescribedBodyDoesNotHideWhatItCarries) {
  OnVehicle c(true);
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree) << c.Run().reason;
  const ForceScale scale = ForceScaleOf(c.Input(), c.analytic);
  EXPECT_NEAR(scale.force_N, 2.0 * 9.81, 1e-9);
  EXPECT_NEAR(scale.driven[0], 2.0 * 9.81, 1e-9);  // d2
  EXPECT_NEAR(scale.driven[1], 1e7 * 9.81, 1e-2);  // the vehicle's own
  Stretch(&c.simulated, "d2.force", 1.0 + 2e-10);  // twice the limit
  EXPECT_TRUE(CheckFails(c.Run(), "simulated_vs_analytic.force_nrmse"));
}

TEST(ForceScale, ADrivenBodyDoesNotHideWhatAnotherDriveCarries) {
  OnVehicle c(false);
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree) << c.Run().reason;
  Stretch(&c.simulated, "d2.force", 1.0001);
  const Comparison comparison = c.Run();
  EXPECT_FALSE(CheckFails(comparison, "simulated_vs_analytic.force_nrmse"));  // of both together
  EXPECT_TRUE(CheckFails(comparison, "simulated_vs_analytic.force_nrmse_own"));
  EXPECT_NEAR(comparison.FindPair("simulated_vs_analytic")->drives[1].nrmse, 1e-4, 1e-9);
  EXPECT_FALSE(comparison.FindPair("simulated_vs_analytic")->drives[1].floored);
}

TEST(ForceScale, AFixedBodyDoesNotCount) {
  Case c;
  c.mechanism.bodies.push_back({.name = "rock", .mass = 1e12, .frames = {}, .shapes = {}});
  Joint fixed;
  fixed.name = "bolt";
  fixed.child = 3;
  c.mechanism.joints.push_back(fixed);
  EXPECT_LT(ForceScaleOf(c.Input(), c.analytic).force_N, 20.0);
}

TEST(ForceScale, ALoadOnAPrescribedBodyDoesNotCount) {
  OnVehicle c(true);
  Load load;
  load.body = 1;
  load.force = {Constant(0.0), Constant(0.0), Constant(1e9)};
  load.moment = {Constant(0.0), Constant(0.0), Constant(0.0)};
  c.motion.loads = {load};
  const ForceScale scale = ForceScaleOf(c.Input(), c.analytic);
  EXPECT_NEAR(scale.force_N, 2.0 * 9.81, 1e-9);
  EXPECT_NEAR(scale.Floor("N"), 2e-3 * 9.81, 1e-12);
}

TEST(ForceScale, AFreeHullCountsWithWhatItTakesToMoveTheArmOnly) {
  Case c;
  c.mechanism.bodies[1].mass = 1e9;  // slides freely, d2 pushes the 1 kg on it
  c.mechanism.gravity_W.setZero();
  c.motion.forces = {{0, Constant(0.0)}};
  const ForceScale scale = ForceScaleOf(c.Input(), c.analytic);
  const double w = 2.0 * std::numbers::pi;
  EXPECT_NEAR(scale.driven[1], 0.2 * w * w / std::numbers::sqrt2, 0.1);
  EXPECT_EQ(scale.driven[0], 0.0);
}

TEST(ForceScale, AFloorThatActsIsSaidBesideNrmseAndDigits) {
  Case c;
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) Stretch(trace, "d2.force", 1e-6);
  const PairComparison pair = ComparePair(c.Input(), c.simulated, c.analytic);
  EXPECT_FALSE(pair.drives[0].floored);
  EXPECT_TRUE(pair.drives[1].floored);
  EXPECT_TRUE(pair.metrics.at(Metric::kForceOwn).floored ||
              pair.metrics.at(Metric::kForceOwn).channel == "d1.force");
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) Stretch(trace, "d1.force", 1e-6);
  const Comparison comparison = c.Run();
  EXPECT_TRUE(comparison.FindCheck("simulated_vs_analytic.force_nrmse")->floored);
  EXPECT_FALSE(comparison.FindCheck("simulated_vs_analytic.position_m")->floored);
}

// A base that lifts the vehicle with 1e8 W; the cart's drive has 20 W at most.
struct Lifted : OnVehicle {
  Lifted() : OnVehicle(true) {
    motion.commands[0].profile = {{RampTerm{1.0}}};
    AddChannel(this, {"power.base", "W", ""}, (1e7 + 2.0) * 9.81);
    for (const char* part : {"power.loads", "power.dampers", "power.springs"}) {
      AddChannel(this, {part, "W", ""}, 0.0);
    }
    for (Trace* trace : {&analytic, &reference, &simulated}) {
      const VecX drive = trace->values.col(trace->Find("d2.force"))
                             .cwiseProduct(trace->values.col(trace->Find("d2.velocity")));
      for (const char* name : {"power.input", "power.energy_rate"}) {
        trace->values.col(trace->Find(name)) = drive.array() + (1e7 + 2.0) * 9.81;
      }
    }
  }
};

TEST(PowerScale, ThePowerOfTheBaseDoesNotHideTheDrives) {
  Lifted c;
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree) << c.Run().reason;
  // Twice the limit of what the cart's weight takes at 1 m/s and its own speed.
  Bend(&c.simulated, "power.energy_rate", 2e-8 * 19.62 * (1.0 + 0.4 * std::numbers::pi));
  EXPECT_TRUE(CheckFails(c.Run(), "simulated.power_balance"));
}

TEST(PowerScale, RoundOffOfAHeavyBaseIsNoImbalance) {
  Lifted c;
  for (const char* name : {"power.input", "power.energy_rate", "power.base"}) {
    Bend(&c.simulated, name, 1e11);
  }
  Bend(&c.simulated, "power.energy_rate", 1e-4);  // ten units in the last place
  EXPECT_FALSE(CheckFails(c.Run(), "simulated.power_balance"));
  Bend(&c.simulated, "power.energy_rate", 1e-3);
  EXPECT_TRUE(CheckFails(c.Run(), "simulated.power_balance"));
}

}  // namespace
}  // namespace mbv
