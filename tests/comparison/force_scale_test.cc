// Floors scale with what the compared drives carry, and show where they act.
#include "comparison/force_scale.h"

#include <gtest/gtest.h>

#include <limits>

#include "mechanism/channels.h"
#include "mechanism/reach.h"
#include "tests/comparison/carried.h"

namespace mbv {
namespace {

using synthetic::AddChannel;
using synthetic::Case;
using synthetic::OnVehicle;
using synthetic::Perturb;
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

// Slides that lie across gravity and rest: their error is not a share of zero.
TEST(ForceScale, RoundoffOfForcesAcrossCountsWhereNothingActsAlong) {
  ForceScale scale;
  scale.force_N = 10.0;
  scale.moment_Nm = 2.0;
  scale.of_unit = {{"N", 0.0}, {"N m", 3.0}};
  EXPECT_DOUBLE_EQ(scale.Floor("N"), 1e-2);
  EXPECT_DOUBLE_EQ(scale.Floor("N m"), 3e-3);
  scale.of_unit["N"] = 1e-6;  // little acts
  EXPECT_DOUBLE_EQ(scale.Floor("N"), 1e-9);
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

TEST(ForceScale, AFloorThatActsIsReportedBesideNrmseAndDigits) {
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

// Each term of the scales by itself, worked out by hand. A rod of 2 kg on a hinge about z, its
// centre 0.5 m away, driven or prescribed; its drive has the same rates at every sample. It weighs
// nothing on its drive.
struct Rod {
  Mechanism mechanism;
  Motion motion;
  Trace trace;

  explicit Rod(double velocity = 0.0, double acceleration = 0.0) {
    mechanism.name = "rod";
    mechanism.bodies = {{.name = "world", .frames = {}, .shapes = {}},
                        {.name = "rod", .mass = 2.0, .frames = {}, .shapes = {}}};
    mechanism.bodies[1].p_BoBcm_B = Vec3(0.5, 0.0, 0.0);
    mechanism.bodies[1].I_Bcm_B = Vec3(0.0, 0.0, 3.0).asDiagonal();
    Joint hinge;
    hinge.name = "hinge";
    hinge.kind = JointKind::kRevolute;
    hinge.child = 1;
    mechanism.joints = {hinge};
    Drive motor;
    motor.name = "motor";
    motor.kind = JointDrive{0, 0};
    mechanism.drives = {motor};
    mechanism.X_WB_home.assign(2, Pose::Identity());
    motion.duration_s = 2.0;
    motion.sample_s = 0.1;
    motion.commands = {
        {"motor", {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}}, {{RampTerm{velocity}}}}};
    std::vector<Channel> channels = DriveChannels(mechanism);
    for (const Channel& more : EnergyChannels()) channels.push_back(more);
    trace.Reset(SampleTimes(2.0, 0.1), channels);
    trace.values.setZero();
    Set("motor.velocity", velocity);
    Set("motor.acceleration", acceleration);
  }
  void Set(const std::string& channel, double value) {
    trace.values.col(trace.Find(channel)).setConstant(value);
  }
  void Prescribe() {
    mechanism.drives.clear();
    mechanism.prescribed = {{"motor", 0}};
    motion.commands[0].terms[0].coordinate.kind = Coordinate::Kind::kPrescribed;
  }
  void Push(const Vec3& force, const Vec3& moment, const Vec3& at) {
    Load load;
    load.body = 1;
    load.p_BoQ_B = at;
    for (int c = 0; c < 3; ++c) {
      load.force[static_cast<size_t>(c)] = Constant(force[c]);
      load.moment[static_cast<size_t>(c)] = Constant(moment[c]);
    }
    motion.loads = {load};
  }
  [[nodiscard]] ComparisonInput Input() const {
    ComparisonInput input;
    input.mechanism = &mechanism;
    input.motion = &motion;
    return input;
  }
  [[nodiscard]] ForceScale Scale() const { return ForceScaleOf(Input(), trace); }
  [[nodiscard]] double length_m() const { return CharacteristicLength(mechanism); }
};

constexpr double kG = 9.81;

TEST(ForceScaleTerms, AMassCountsWithGravityWithItsAccelerationOrWithAHundredthOfItsTurning) {
  EXPECT_NEAR(Rod().Scale().driven[0], 2.0 * 0.5 * kG, 1e-9) << "m v g, wherever gravity points";
  Rod still;
  still.mechanism.gravity_W.setZero();
  Rod accelerates(0.0, 40.0);
  accelerates.mechanism.bodies[1].I_Bcm_B.setZero();
  EXPECT_NEAR(accelerates.Scale().driven[0], 2.0 * 0.5 * (0.5 * 40.0), 1e-9);
  Rod turns(30.0);
  turns.mechanism.gravity_W.setZero();
  turns.mechanism.bodies[1].I_Bcm_B *= 1e-9;
  EXPECT_NEAR(turns.Scale().driven[0], 2.0 * 0.5 * (1e-2 * 0.5 * 900.0), 1e-9);
  EXPECT_NEAR(turns.Scale().force_N, 2.0 * (1e-2 * 0.5 * 900.0), 1e-9);
}

TEST(ForceScaleTerms, AnInertiaCountsWithItsAngularAcceleration) {
  Rod balanced(0.0, 7.0);
  balanced.mechanism.bodies[1].p_BoBcm_B.setZero();
  EXPECT_NEAR(balanced.Scale().driven[0], 3.0 * 7.0, 1e-9);
  EXPECT_TRUE(balanced.Scale().acts) << "though its centre rests";
  EXPECT_NEAR(balanced.Scale().moment[1], 3.0 * 7.0, 1e-9);
  EXPECT_NEAR(balanced.Scale().moment_Nm, 3.0 * 7.0, 1e-9);
  Rod even(20.0);
  even.mechanism.bodies[1].p_BoBcm_B.setZero();
  EXPECT_NEAR(even.Scale().moment[1], 3.0 * (1e-2 * 400.0), 1e-9) << "a hundredth of its rate";
  EXPECT_NEAR(Rod().Scale().moment[1], 3.0 / 4.0, 1e-9) << "1 rad in the time";
}

TEST(ForceScaleTerms, RatesThatAreNotNumbersCountAsNone) {
  Rod rod(0.0, 40.0);
  for (const double bad : {kNan, HUGE_VAL}) {
    rod.trace.values(3, rod.trace.Find("motor.acceleration")) = bad;
    EXPECT_NEAR(rod.Scale().driven[0], 2.0 * 0.5 * kG, 1e-9) << bad;
  }
}

TEST(ForceScaleTerms, ALoadCountsWithItsForceWhereItActsAndWithItsMoment) {
  Rod rod;
  rod.mechanism.gravity_W.setZero();
  rod.Push(Vec3(0.0, 300.0, 400.0), Vec3::Zero(), Vec3(0.0, 2.0, 0.0));
  EXPECT_NEAR(rod.Scale().driven[0], 500.0 * 2.0, 1e-9);
  EXPECT_NEAR(rod.Scale().force_N, 500.0, 1e-9);
  EXPECT_TRUE(rod.Scale().acts);
  rod.Push(Vec3::Zero(), Vec3(0.0, 30.0, 40.0), Vec3::Zero());
  EXPECT_NEAR(rod.Scale().driven[0], 50.0, 1e-9);
  EXPECT_NEAR(rod.Scale().force_N, 50.0 / rod.length_m(), 1e-9);
  EXPECT_TRUE(rod.Scale().acts);
  rod.Push(Vec3(0.0, 0.0, 10.0), Vec3(0.0, 0.0, 50.0), Vec3(2.0, 0.0, 0.0));
  EXPECT_NEAR(rod.Scale().driven[0], 10.0 * 2.0 + 50.0, 1e-9) << "both together";
}

TEST(ForceScaleTerms, ALoadThatFollowsTheStateCountsAsAtHome) {
  Rod rod;
  rod.Push(Vec3::Zero(), Vec3::Zero(), Vec3(1.0, 0.0, 0.0));
  Load::Following part;
  part.component = 1;
  part.function.inputs = {{.coordinate = {Coordinate::Kind::kDrive, 0, 0}}};
  part.function.value = [](double, std::span<const double> q) { return 700.0 + q[0]; };
  rod.motion.loads[0].following = {part};
  EXPECT_NEAR(rod.Scale().driven[0], 700.0, 1e-6);
}

TEST(ForceScaleTerms, ASpringCountsWithTheForceThatItsEnergyAllowsAlongItself) {
  Rod rod;
  rod.mechanism.springs = {{.name = "spring",
                            .body_from = 0,
                            .p_from = Vec3(1.0, 3.0, 0.0),
                            .body_to = 1,
                            .p_to = Vec3(1.0, 0.0, 0.0),
                            .stiffness = 5000.0}};
  rod.Set("energy.springs", 40.0);
  const double force = std::sqrt(2.0 * 5000.0 * 40.0);
  EXPECT_NEAR(rod.Scale().driven[0], force * 1.0, 1e-6);  // the end moves along the spring
  EXPECT_NEAR(rod.Scale().force_N, force, 1e-6);
  EXPECT_TRUE(rod.Scale().acts);
  rod.mechanism.springs[0].p_from = Vec3(4.0, 0.0, 0.0);  // across it
  EXPECT_NEAR(rod.Scale().driven[0], 2.0 * 0.5 * kG, 1e-6);
  rod.Set("energy.springs", 0.0);
  EXPECT_NEAR(rod.Scale().force_N, 2.0 * kG, 1e-9);
}

TEST(ForceScaleTerms, AnElementCountsWithItsForceAlongItsCoordinate) {
  Rod rod(5.0);
  rod.mechanism.elements = {{.name = "damper", .joint = 0, .law = DampingLaw{60.0}}};
  EXPECT_NEAR(rod.Scale().driven[0], 60.0 * 5.0, 1e-9);
  rod.mechanism.elements[0].law = FrictionLaw{.coulomb = 800.0};
  EXPECT_NEAR(rod.Scale().driven[0], 800.0, 1e-9);
}

TEST(ForceScaleTerms, AnElementCountsForTheDrivesThatMoveItsCoordinate) {
  Case c;
  c.mechanism.X_WB_home.assign(3, Pose::Identity());
  const double without = ForceScaleOf(c.Input(), c.analytic).driven[0];
  c.mechanism.elements = {{.name = "brake", .joint = 1, .law = FrictionLaw{.coulomb = 1e6}}};
  const ForceScale scale = ForceScaleOf(c.Input(), c.analytic);
  EXPECT_EQ(scale.driven[0], without) << "the first slide carries the second with its brake";
  EXPECT_NEAR(scale.driven[1], 1e6, 1e-6);
}

TEST(ForceScaleTerms, APrescribedJointFeelsWhatCrossesIt) {
  // Balanced and even, so that its own work is nothing: a lever of a thousandth of the length, and
  // a hundredth of the turning.
  Rod rod(0.0);
  rod.Prescribe();
  rod.mechanism.bodies[1].p_BoBcm_B.setZero();
  rod.mechanism.bodies[1].I_Bcm_B *= 1e-9;
  EXPECT_NEAR(rod.Scale().driven[0], 1e-3 * rod.length_m() * 2.0 * kG, 1e-7);
  rod.mechanism.bodies[1].I_Bcm_B = Vec3(0.0, 0.0, 300.0).asDiagonal();
  EXPECT_NEAR(rod.Scale().driven[0], 300.0 / 4.0, 1e-9);
  rod.motion.commands[0].profile = {{RampTerm{20.0}}};
  EXPECT_NEAR(rod.Scale().driven[0], 300.0 * (1e-2 * 400.0), 1e-6);
  EXPECT_EQ(rod.Scale().power_W, std::numeric_limits<double>::infinity()) << "all are prescribed";
}

TEST(ForceScaleTerms, ThePrescribedRatesAreThoseOfTheCommand) {
  // a sin(ω t): RMS velocity a ω / √2, acceleration a ω² / √2 over whole periods.
  Rod rod;
  rod.Prescribe();
  rod.mechanism.gravity_W.setZero();
  rod.mechanism.bodies[1].p_BoBcm_B.setZero();
  rod.motion.commands[0].profile = {{SineTerm{0.5, 1.0, 0.0}}};
  const double w = 2.0 * std::numbers::pi;
  EXPECT_NEAR(rod.Scale().driven[0], 3.0 * 0.5 * w * w / std::numbers::sqrt2, 2.0);
  rod.mechanism.bodies[1].I_Bcm_B *= 1e-9;
  rod.mechanism.bodies[1].p_BoBcm_B = Vec3(0.5, 0.0, 0.0);
  rod.motion.commands[0].profile = {{RampTerm{30.0}}};
  EXPECT_NEAR(rod.Scale().driven[0], 2.0 * 0.5 * (1e-2 * 0.5 * 900.0), 1e-6);
}

TEST(ForceScaleTerms, ThePowerIsTheForceAtTheFastestBodysSpeed) {
  OnVehicle c(true);
  c.motion.commands[0].profile = {{RampTerm{3.0}}};  // lifts the cart, too
  const double w = 2.0 * std::numbers::pi;
  const ForceScale scale = ForceScaleOf(c.Input(), c.analytic);
  EXPECT_NEAR(scale.force_N, 2.0 * kG, 1e-9);
  EXPECT_NEAR(scale.power_W, 2.0 * kG * (3.0 + 0.2 * w), 0.01);
}

// What a drive carries is judged by the body that weighs most on it, whichever that is.
TEST(ForceScaleTerms, DrivesAreCarriedByTheBodiesThatTheyMove) {
  Case c;
  c.mechanism.joints[1].parent = 0;  // beside each other
  const ForceScale apart = ForceScaleOf(c.Input(), c.analytic);
  for (const size_t d : {0u, 1u}) {
    EXPECT_TRUE(apart.carries[d][d]);
    EXPECT_FALSE(apart.carries[d][1 - d]);
  }
  // Little beside the body that a drive moves most, wherever that is in the row, is round-off.
  DrivenTwists twists = TwistsFor(c.Input());
  twists.V_WB[1][1] = 1e-12 * twists.V_WB[1][2];
  ComparisonInput input = c.Input();
  input.twists = &twists;
  EXPECT_FALSE(ForceScaleOf(input, c.analytic).carries[0][1]);
  const Case in_a_row;
  const ForceScale row = ForceScaleOf(in_a_row.Input(), in_a_row.analytic);
  EXPECT_TRUE(row.carries[1][0]) << "d1 moves what weighs on d2";
  // A drive that only turns the other's body about its origin moves it, too.
  Case turned;
  turned.mechanism.joints[1].kind = JointKind::kRevolute;
  turned.mechanism.bodies[2].I_Bcm_B = Mat3::Identity();
  turned.mechanism.bodies[2].mass = 3.0;
  const ForceScale about = ForceScaleOf(turned.Input(), turned.analytic);
  EXPECT_TRUE(about.carries[0][1]) << "d2 turns the last body, which weighs on d1 as well";
  EXPECT_TRUE(about.carries[1][0]) << "d1 shifts it";
}

TEST(ForceScaleTerms, WhatActsIsWeightMotionOrAPush) {
  Case c;  // along z, at rest
  Trace still = c.analytic;
  for (const char* signal : {"d1.velocity", "d1.acceleration", "d2.velocity", "d2.acceleration"}) {
    Stretch(&still, signal, 0.0);
  }
  EXPECT_TRUE(ForceScaleOf(c.Input(), still).acts) << "weight";
  c.mechanism.gravity_W.setZero();
  EXPECT_FALSE(ForceScaleOf(c.Input(), still).acts);
  EXPECT_TRUE(ForceScaleOf(c.Input(), c.analytic).acts) << "motion of points";
  Rod rod(0.0);
  EXPECT_FALSE(rod.Scale().acts) << "weight across the axis";
}

TEST(ForceScaleTerms, WhereNothingActsBodiesGoTheirLengthInTheTime) {
  Rod rod(0.0);
  rod.mechanism.gravity_W.setZero();
  const double acceleration = rod.length_m() / 4.0;  // in 2 s
  EXPECT_NEAR(rod.Scale().acceleration[1], acceleration, 1e-12);
  EXPECT_NEAR(rod.Scale().force_N, 2.0 * acceleration, 1e-12);
  rod.mechanism.bodies[1].I_Bcm_B *= 100.0;  // 1 rad, as the length at the length
  EXPECT_NEAR(rod.Scale().driven[0], 300.0 * acceleration / rod.length_m(), 1e-9);
}

TEST(ForceScaleTerms, RestIsAThousandthOfTheLengthOrOfARadianInTheTime) {
  Rod rod;
  rod.mechanism.gravity_W = Vec3(0.0, 0.0, -1e-9);
  const double length_m = rod.length_m();
  ASSERT_NE(length_m, 1.0);
  EXPECT_NEAR(RestFloorOf(rod.Input(), "m").velocity, 1e-3 * length_m / 2.0, 1e-12);
  EXPECT_NEAR(RestFloorOf(rod.Input(), "rad").velocity, 1e-3 / 2.0, 1e-12);
  EXPECT_NEAR(RestFloorOf(rod.Input(), "m").acceleration, 1e-3 * length_m / 4.0, 1e-9);
  rod.mechanism.gravity_W = Vec3(0.0, 0.0, -1000.0);
  EXPECT_NEAR(RestFloorOf(rod.Input(), "m").acceleration, 1e-4 * 1000.0, 1e-9);
  EXPECT_NEAR(RestFloorOf(rod.Input(), "rad").acceleration, 1e-4 * 1000.0 / length_m, 1e-9);
  // With the drives' rates: angles at the length.
  const Rod fast(50.0, 1e5);
  EXPECT_NEAR(RestFloorOf(fast.Input(), "rad", fast.trace).velocity, 1e-3 * 50.0, 1e-9);
  EXPECT_NEAR(RestFloorOf(fast.Input(), "m", fast.trace).velocity, 1e-3 * 50.0 * length_m, 1e-9);
  EXPECT_NEAR(RestFloorOf(fast.Input(), "m", fast.trace).acceleration, 1e-3 * 1e5 * length_m, 1e-9);
}

// 2 kg with 400 J go at 20 m/s, which turns in L with v²/L; 2 kW more or less every second change
// that by 50 m/s².
TEST(ForceScaleTerms, RestIsAThousandthOfTheRatesOfAllBodies) {
  Rod rod;
  rod.Set("energy.kinetic", 400.0);
  const double length_m = rod.length_m(), turning = 400.0 / length_m;
  EXPECT_NEAR(RestFloorOf(rod.Input(), "m", rod.trace).velocity, 0.02, 1e-9);
  EXPECT_NEAR(RestFloorOf(rod.Input(), "rad", rod.trace).velocity, 0.02 / length_m, 1e-9);
  EXPECT_NEAR(RestFloorOf(rod.Input(), "m", rod.trace).acceleration, 1e-3 * turning, 1e-9);
  const int energy = rod.trace.Find("energy.kinetic");
  for (Eigen::Index i = 0; i < rod.trace.values.rows(); ++i) {
    rod.trace.values(i, energy) = 400.0 + (i % 2 == 0 ? 1e4 : -1e4) * 0.01;
  }
  const double mean = rod.trace.values.col(energy).mean(), v = std::sqrt(mean);
  EXPECT_NEAR(RestFloorOf(rod.Input(), "m", rod.trace).acceleration,
              1e-3 * std::max(mean / length_m, 2000.0 / (2.0 * v)), 1e-9);
  rod.trace.values(3, energy) = kNan;
  EXPECT_NEAR(RestFloorOf(rod.Input(), "m", rod.trace).velocity, 1e-3 * length_m / 2.0, 1e-12);
}

TEST(ForceScaleTerms, ElementsHaveTheForceThatTheirLawAsksOfTheMotion) {
  Rod rod(5.0, 30.0);
  const DrivenTwists twists = TwistsFor(rod.Input());
  const auto size = [&](const auto& law, double energy_J = 1e9) {
    rod.mechanism.elements = {{.name = "element", .joint = 0, .law = law}};
    const auto sizes = internal::SizesOfElements(
        rod.mechanism, {{.V_WB = twists.V_WB.data(), .velocity = 5.0, .acceleration = 30.0}},
        {.duration_s = 2.0, .most_energy_J = energy_J});
    EXPECT_EQ(sizes.size(), 1u);
    EXPECT_NEAR(sizes[0].rate[0], 1.0, 1e-12);
    return sizes[0].force;
  };
  EXPECT_NEAR(size(DampingLaw{60.0}), 60.0 * 5.0, 1e-9);
  EXPECT_NEAR(size(RotorLaw{.inertia = 0.5, .ratio = 4.0}), 0.5 * 16.0 * 30.0, 1e-9);
  EXPECT_NEAR(size(FrictionLaw{.coulomb = 8.0}), 8.0, 1e-12);
  // A spring at home (the coordinate is 0 there), as far as it gets, or as far as energy allows.
  EXPECT_NEAR(size(SpringLaw{.polynomial = {3.0, 2.0}, .free = -10.0, .preload = 40.0}, 0.0),
              40.0 + 3.0 * 10.0 + 2.0 * 100.0, 1e-9);
  EXPECT_NEAR(size(SpringLaw{.polynomial = {3.0}}), 3.0 * 5.0 * 2.0, 1e-9);
  EXPECT_NEAR(size(SpringLaw{.polynomial = {3.0}}, 6.0), std::sqrt(2.0 * 3.0 * 6.0), 1e-9);
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
  Perturb(&c.simulated, "power.energy_rate", 2e-8 * 19.62 * (1.0 + 0.4 * std::numbers::pi));
  EXPECT_TRUE(CheckFails(c.Run(), "simulated.power_balance"));
}

TEST(PowerScale, WhatTheDrivesDoCountsBesideABaseHoweverHardTheyPush) {
  Lifted c;
  Trace& trace = c.simulated;
  Stretch(&trace, "d2.force", 1000.0);
  const VecX drive = trace.values.col(trace.Find("d2.force"))
                         .cwiseProduct(trace.values.col(trace.Find("d2.velocity")));
  for (const char* name : {"power.input", "power.energy_rate"}) {
    trace.values.col(trace.Find(name)) = drive.array() + (1e7 + 2.0) * 9.81;
  }
  Perturb(&trace, "power.energy_rate", 10.0);
  const Comparison comparison = c.Run();
  ASSERT_NE(comparison.FindCheck("simulated.power_balance"), nullptr);
  EXPECT_NEAR(comparison.FindCheck("simulated.power_balance")->value,
              10.0 / drive.cwiseAbs().maxCoeff(), 1e-9);
}

TEST(PowerScale, RoundOffOfAHeavyBaseIsNotAnImbalance) {
  Lifted c;
  for (const char* name : {"power.input", "power.energy_rate", "power.base"}) {
    Perturb(&c.simulated, name, 1e11);
  }
  Perturb(&c.simulated, "power.energy_rate", 1e-4);  // ten units in the last place
  EXPECT_FALSE(CheckFails(c.Run(), "simulated.power_balance"));
  Perturb(&c.simulated, "power.energy_rate", 1e-3);
  EXPECT_TRUE(CheckFails(c.Run(), "simulated.power_balance"));
}

}  // namespace
}  // namespace mbv
