// The energy balance of a mass on a damped spring, pushed by a motor, worked out by hand.
#include "comparison/comparison.h"

#include <gtest/gtest.h>

#include <cmath>

#include "comparison/force_scale.h"
#include "mechanism/channels.h"
#include "tests/comparison/carried.h"
#include "tests/comparison/synthetic.h"

namespace mbv::synthetic {
namespace {

constexpr double kLimit = 1e-8;

// x = sin 3t of 2 kg against k = 5 N/m and c = 0.4 N s/m along x: the motor pushes with
// F = (5 − 18) sin 3t + 1.2 cos 3t; the second slide rests.
Trace DampedSpring(const Mechanism& mechanism) {
  std::vector<Channel> channels = DriveChannels(mechanism);
  for (const auto& more : {AuditChannels(), EnergyChannels(), WorkChannels(mechanism)}) {
    channels.insert(channels.end(), more.begin(), more.end());
  }
  Trace trace;
  trace.witness = "simulated";
  trace.Reset(SampleTimes(2.0, 0.01), channels);
  trace.values.setZero();
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const double t = trace.time_s[i], s = std::sin(3 * t), c = std::cos(3 * t);
    const auto set = [&](const std::string& name, double value) {
      trace.values(static_cast<Eigen::Index>(i), trace.Find(name)) = value;
    };
    const double v = 3 * c, force = -13 * s + 1.2 * c;
    const double damped = 0.4 * (4.5 * t + 0.75 * std::sin(6 * t));  // ∫ 0.4 v² dt
    set("d1.position", s);
    set("d1.velocity", v);
    set("d1.acceleration", -9 * s);
    set("d1.force", force);
    set("power.dampers", -0.4 * v * v);
    set("power.springs", -5 * s * v);
    set("power.input", force * v - 0.4 * v * v);
    set("power.energy_rate", 2 * v * -9 * s + 5 * s * v);
    set("energy.kinetic", v * v);
    set("energy.springs", 2.5 * s * s);
    set("d1.work", (9 * c * c + 2.5 * s * s - 9) + damped);
    set("dampers.work", -damped);
  }
  return trace;
}

struct Pushed {
  Mechanism mechanism = TwoSliders();
  Motion motion = TwoSines();
  Trace trace = DampedSpring(mechanism);

  [[nodiscard]] ComparisonInput Input() const {
    return {.mechanism = &mechanism,
            .motion = &motion,
            .limits = {},
            .simulation_limits = LimitColumn::kForward,
            .witnesses = {},
            .driven_by = "reference",
            .reactions_not_unique = {}};
  }
  [[nodiscard]] EnergyAudit Audit() const { return *AuditEnergy(Input(), trace, kLimit); }
};

TEST(EnergyAudit, WorkSpringAndDamperOfAHandExampleBalance) {
  const Pushed run;
  const EnergyAudit audit = run.Audit();
  EXPECT_TRUE(audit.integrated);
  EXPECT_LT(audit.drift.value, 64 * kEps);
  EXPECT_TRUE(std::isnan(audit.from_s));
  EXPECT_TRUE(audit.text.empty()) << audit.text;
  double work = 0.0, stored = 0.0;
  for (const EnergyPart& part : audit.parts) (part.stored ? stored : work) += part.end_J;
  EXPECT_NEAR(work, stored, 1e-12);
  EXPECT_NEAR(stored, 9 * std::pow(std::cos(6.0), 2) + 2.5 * std::pow(std::sin(6.0), 2) - 9, 1e-12);
}

TEST(EnergyAudit, ADriveForceTooLargeByAThousandthIsFoundAndNamed) {
  Pushed run;
  Stretch(&run.trace, "d1.force", 1.001);
  Stretch(&run.trace, "d1.work", 1.001);
  const EnergyAudit audit = run.Audit();
  EXPECT_GT(audit.drift.value, 1e-4);
  EXPECT_NEAR(audit.share, -1e-3 / 1.001, 1e-9);
  EXPECT_EQ(audit.culprit, "d1");
  EXPECT_NEAR(audit.from_s, 0.01, 1e-12);
  EXPECT_NE(audit.text.find("work of d1 that is 0.1 % too large"), std::string::npos) << audit.text;
  // The recorded forces alone are perturbed: the power balance reports.
  Pushed forces;
  Stretch(&forces.trace, "d1.force", 1.001);
  const WitnessMetrics metrics = MeasureWitness(forces.Input(), forces.trace);
  EXPECT_GT(metrics.metrics.at(Metric::kPower).value, 1e-4);
  EXPECT_LT(MeasureWitness(run.Input(), Pushed().trace).metrics.at(Metric::kPower).value,
            64 * kEps);
}

TEST(EnergyAudit, ADriftThatBeginsLaterIsDatedAndALostDamperIsNamed) {
  Pushed run;
  Perturb(&run.trace, "energy.kinetic", 1e-5, 120);
  EXPECT_NEAR(run.Audit().from_s, 1.2, 1e-12);
  EXPECT_NEAR(run.Audit().end_drift_J, 1e-5, 1e-12);
  Pushed damper;
  Stretch(&damper.trace, "dampers.work", 0.9);
  EXPECT_EQ(damper.Audit().culprit, "dampers");
  EXPECT_NEAR(damper.Audit().share, 0.1 / 0.9, 1e-9);
}

TEST(EnergyAudit, WithoutIntegratedWorkThePowersAreIntegratedAndNothingIsJudged) {
  Pushed run;
  for (Channel& channel : run.trace.channels) {
    if (channel.name.ends_with(".work")) channel.name += "_unknown";
  }
  const EnergyAudit audit = run.Audit();
  EXPECT_FALSE(audit.integrated);
  EXPECT_LT(audit.drift.value, 1e-6);  // cubics at 10 ms
  EXPECT_FALSE(MeasureWitness(run.Input(), run.trace).metrics.contains(Metric::kEnergy));
}

TEST(EnergyAudit, WhatIsNotJudgedNamesNoCulprit) {
  Pushed run;
  Stretch(&run.trace, "d1.force", 1.001);
  for (Channel& channel : run.trace.channels) {
    if (channel.name.ends_with(".work")) channel.name += "_unknown";
  }
  const EnergyAudit audit = run.Audit();
  EXPECT_GT(audit.drift.value, 1e-4);
  EXPECT_TRUE(audit.text.empty()) << audit.text;
  EXPECT_TRUE(audit.culprit.empty());
  EXPECT_TRUE(std::isnan(audit.from_s));
}

// A heavy vehicle takes 1e8 J from what moves it; the cart on it has 9 J.
struct OnMovingVehicle : OnVehicle {
  OnMovingVehicle() : OnVehicle(true) {
    std::vector<Channel> channels = DriveChannels(mechanism);
    for (const auto& more : {AuditChannels(), EnergyChannels(), WorkChannels(mechanism)}) {
      channels.insert(channels.end(), more.begin(), more.end());
    }
    trace.witness = "simulated";
    trace.Reset(SampleTimes(1.0, 0.01), channels);
    trace.values.setZero();
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const double t = trace.time_s[i];
      const auto set = [&](const std::string& name, double value) {
        trace.values(static_cast<Eigen::Index>(i), trace.Find(name)) = value;
      };
      const double vehicle = 1e8 * std::sin(t), cart = 9 * std::pow(std::sin(3 * t), 2);
      set("energy.kinetic", vehicle + cart);
      set("vehicle.work", vehicle);
      set("d2.work", cart);
    }
  }
  [[nodiscard]] EnergyAudit Audit() const {
    return *AuditEnergy({.mechanism = &mechanism,
                         .motion = &motion,
                         .limits = {},
                         .simulation_limits = LimitColumn::kForward,
                         .witnesses = {},
                         .driven_by = "reference",
                         .reactions_not_unique = {}},
                        trace, 1e-6);
  }
  Trace trace;
};

TEST(EnergyAudit, EnergyOfABaseDoesNotHideADrive) {
  OnMovingVehicle run;
  EXPECT_EQ(run.Audit().drift.value, 0.0) << "what rounding 1e8 J leaves is not a drift";
  EXPECT_LT(run.Audit().scale_J, 1e4);
  run.trace.values.col(run.trace.Find("d2.work")) *= 1.5;
  const EnergyAudit audit = run.Audit();
  EXPECT_GT(audit.drift.value, 0.2) << "of the energy that the cart has";
  EXPECT_LT(audit.drift_J, 1e-6 * 1e8) << "beside the vehicle's it would be nothing";
  EXPECT_EQ(audit.culprit, "d2");
}

// The energy turned over: the largest kinetic energy or work, whichever is more, and at least what
// the force scale does over a thousandth of the length.
TEST(EnergyScale, IsTheLargestOfKineticEnergyWorkAndWhatForcesDoAtLeast) {
  Pushed run;
  EXPECT_NEAR(run.Audit().scale_J, 9.0, 1e-9) << "kinetic";
  Stretch(&run.trace, "energy.kinetic", 0.1);
  VecX work = run.trace.values.col(run.trace.Find("d1.work")) +
              run.trace.values.col(run.trace.Find("dampers.work"));
  EXPECT_NEAR(run.Audit().scale_J, work.cwiseAbs().maxCoeff(), 1e-9) << "work";
  for (const char* part : {"energy.kinetic", "energy.springs", "d1.work", "dampers.work"}) {
    Stretch(&run.trace, part, 0.0);
  }
  const ForceScale force = ForceScaleOf(run.Input(), run.trace);
  EXPECT_NEAR(run.Audit().scale_J, 1e-3 * force.length_m * force.force_N, 1e-12);
}

TEST(EnergyScale, BesideABaseIsWhatTheCarriedBodiesOrTheDrivesCanDo) {
  OnMovingVehicle run;
  const ComparisonInput input{.mechanism = &run.mechanism,
                              .motion = &run.motion,
                              .limits = {},
                              .simulation_limits = LimitColumn::kForward,
                              .witnesses = {},
                              .driven_by = "reference",
                              .reactions_not_unique = {}};
  for (const char* signal : {"d2.velocity"}) {
    run.trace.values.col(run.trace.Find(signal)).setConstant(2.0);
  }
  const ForceScale force = ForceScaleOf(input, run.trace);
  ASSERT_GT(force.power_W, 9.0);
  EXPECT_NEAR(run.Audit().scale_J, force.power_W * 1.0, 1e-9) << "in the second that it takes";
  run.trace.values.col(run.trace.Find("d2.velocity")).setZero();
  EXPECT_NEAR(run.Audit().scale_J, 9.0, 0.01) << "what the drive has done";
  // At rest in an even lift: no less than what forces do at least.
  run.trace.values.col(run.trace.Find("d2.work")).setZero();
  const ForceScale at_rest = ForceScaleOf(input, run.trace);
  EXPECT_NEAR(run.Audit().scale_J, 1e-3 * at_rest.length_m * at_rest.force_N, 1e-12);
}

TEST(EnergyScale, AShareOfTheBasesEnergyIsNotADriftAndOfNothingElse) {
  OnMovingVehicle run;
  const double base_J = 1e8 * std::sin(1.0) + 9.0;
  Perturb(&run.trace, "d2.work", 0.5e-8 * base_J);
  EXPECT_EQ(run.Audit().drift.value, 0.0);
  Perturb(&run.trace, "d2.work", 1.5e-8 * base_J);
  EXPECT_GT(run.Audit().drift.value, 0.0);
  OnMovingVehicle light;  // a base that turns over no more than the drive
  for (const char* part : {"energy.kinetic", "vehicle.work"}) Stretch(&light.trace, part, 0.0);
  light.trace.values.col(light.trace.Find("energy.kinetic")) =
      light.trace.values.col(light.trace.Find("d2.work"));
  Perturb(&light.trace, "d2.work", 1e-9);
  EXPECT_GT(light.Audit().drift.value, 0.0);
}

TEST(EnergyAudit, WithoutItsWorkABaseCountsWithItsPower) {
  OnMovingVehicle run;
  for (Channel& channel : run.trace.channels) {
    if (channel.name == "vehicle.work") channel.name = "vehicle.work_unknown";
    if (channel.name == "d2.work") channel.name = "d2.work_unknown";
  }
  run.trace.values.col(run.trace.Find("energy.kinetic")).setZero();
  const int base = run.trace.Find("power.base");
  // P = 4 t³ − 3 t², of which cubics through four samples make exactly t⁴ − t³.
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const double t = run.trace.time_s[i];
    const auto row = static_cast<Eigen::Index>(i);
    run.trace.values(row, base) = 4e6 * t * t * t - 3e6 * t * t;
    run.trace.values(row, run.trace.Find("energy.kinetic")) = 1e6 * (t * t * t * t - t * t * t);
  }
  const EnergyAudit audit = run.Audit();
  EXPECT_FALSE(audit.integrated);
  EXPECT_LT(audit.drift_J, 1e6 * 64 * kEps);
  const auto part = std::find_if(audit.parts.begin(), audit.parts.end(),
                                 [](const EnergyPart& p) { return p.name == "base motion"; });
  ASSERT_NE(part, audit.parts.end());
  EXPECT_NEAR(part->most_J, 1e6 * 27.0 / 256.0, 50.0);
}

TEST(EnergyAudit, WhatIsNotANumberIsNotABalance) {
  Pushed run;
  run.trace.values(50, run.trace.Find("energy.springs")) = kNan;
  EXPECT_TRUE(std::isnan(run.Audit().drift.value));
}

// Two parts that explain a drift equally are both named, one that explains it less is not.
TEST(EnergyAudit, PartsThatExplainItEquallyAreBothNamed) {
  Pushed run;
  const VecX damped = run.trace.values.col(run.trace.Find("dampers.work"));
  run.trace.values.col(run.trace.Find("loads.work")) = damped;
  run.trace.values.col(run.trace.Find("d1.work")) -= damped;
  Stretch(&run.trace, "dampers.work", 0.9);
  EXPECT_NE(run.Audit().text.find(" or work of "), std::string::npos) << run.Audit().text;
  // A part that is a fifth off explains less: it is not named beside one that explains all.
  Pushed alone;
  VecX like = damped;
  for (Eigen::Index i = 0; i < like.size(); ++i) {
    like[i] += 0.3 * std::sin(20.0 * alone.trace.time_s[static_cast<size_t>(i)]);
  }
  alone.trace.values.col(alone.trace.Find("loads.work")) = like;
  alone.trace.values.col(alone.trace.Find("d1.work")) -= like;
  Stretch(&alone.trace, "dampers.work", 0.9);
  EXPECT_EQ(alone.Audit().text.find(" or "), std::string::npos) << alone.Audit().text;
}

// The power balance is relative to the largest flow, to the kinetic energy over the time, and at
// rest to what forces do at the speed of rest.
TEST(PowerScaleTerms, EachFlowCountsAlone) {
  for (const char* flow : {"power.base", "power.loads", "power.dampers", "power.gravity",
                           "power.springs", "power.input"}) {
    Pushed run;
    run.trace.values.setZero();
    run.trace.values.col(run.trace.Find("power.energy_rate")).setConstant(1.0);
    run.trace.values.col(run.trace.Find(flow)).setConstant(1e6);
    const WitnessMetrics metrics = MeasureWitness(run.Input(), run.trace);
    // Inputs are not balanced where they flow in; what is exchanged inside is a scale only.
    EXPECT_LT(metrics.metrics.at(Metric::kPower).value, 2.0) << flow;
    EXPECT_GT(metrics.metrics.at(Metric::kPower).value, 0.5e-6) << flow;
    const bool inside =
        std::string(flow) == "power.gravity" || std::string(flow) == "power.springs";
    if (inside) {
      EXPECT_NEAR(metrics.metrics.at(Metric::kPower).value, 1e-6, 1e-12) << flow;
    }
  }
}

TEST(PowerScaleTerms, KineticEnergyCountsOverTheTimeAndRestWithTheSpeedOfRest) {
  Pushed run;
  run.trace.values.setZero();
  run.trace.values.col(run.trace.Find("power.energy_rate")).setConstant(1e-6);
  const auto power = [&] {
    return MeasureWitness(run.Input(), run.trace).metrics.at(Metric::kPower).value;
  };
  const ForceScale force = ForceScaleOf(run.Input(), run.trace);
  const double rest = RestFloorOf(run.Input(), "m").velocity;
  EXPECT_NEAR(power(), 1e-6 / std::max(1e-6, rest * 1e-3 * force.force_N), 1e-9);
  run.trace.values.col(run.trace.Find("d1.force")).setConstant(500.0);
  EXPECT_NEAR(power(), 1e-6 / (rest * 500.0), 1e-12) << "a drive that holds";
  run.trace.values.col(run.trace.Find("energy.kinetic")).setConstant(60.0);
  EXPECT_NEAR(power(), 1e-6 / (60.0 / 2.0), 1e-13) << "over the 2 s";
}

TEST(PowerScaleTerms, RoundOffIsForgivenBesideABaseOnly) {
  Pushed run;
  run.trace.values.setZero();
  for (const char* side : {"power.input", "power.energy_rate", "power.loads"}) {
    run.trace.values.col(run.trace.Find(side)).setConstant(1e6);
  }
  run.trace.values(3, run.trace.Find("power.input")) += 1e-9;  // a few units in the last place
  EXPECT_GT(MeasureWitness(run.Input(), run.trace).metrics.at(Metric::kPower).value, 0.0);
}

TEST(Start, OfAFreeMotionIsHeldAgainstItsValues) {
  Pushed run;
  run.motion.commands.clear();
  run.motion.initial = {{.name = "d1", .coordinate = {Coordinate::Kind::kDrive, 0, 0}}};
  run.motion.initial[0].position = 0.25;
  ASSERT_TRUE(run.motion.free());
  EXPECT_NEAR(MeasureWitness(run.Input(), run.trace).metrics.at(Metric::kCommandM).value, 0.25,
              1e-12);
}

}  // namespace
}  // namespace mbv::synthetic
