// The energy balance of a mass on a damped spring, pushed by a motor, worked out by hand.
#include "comparison/energy_audit.h"

#include <gtest/gtest.h>

#include <cmath>

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
  // The recorded forces alone are bent: the power balance tells.
  Pushed forces;
  Stretch(&forces.trace, "d1.force", 1.001);
  const WitnessMetrics metrics = MeasureWitness(forces.Input(), forces.trace);
  EXPECT_GT(metrics.metrics.at(Metric::kPower).value, 1e-4);
  EXPECT_LT(MeasureWitness(run.Input(), Pushed().trace).metrics.at(Metric::kPower).value,
            64 * kEps);
}

TEST(EnergyAudit, ADriftThatBeginsLaterIsDatedAndALostDamperIsNamed) {
  Pushed run;
  Bend(&run.trace, "energy.kinetic", 1e-5, 120);
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
  EXPECT_EQ(run.Audit().drift.value, 0.0) << "what rounding 1e8 J leaves is no drift";
  EXPECT_LT(run.Audit().scale_J, 1e4);
  run.trace.values.col(run.trace.Find("d2.work")) *= 1.5;
  const EnergyAudit audit = run.Audit();
  EXPECT_GT(audit.drift.value, 0.2) << "of the energy that the cart has";
  EXPECT_LT(audit.drift_J, 1e-6 * 1e8) << "beside the vehicle's it would be nothing";
  EXPECT_EQ(audit.culprit, "d2");
}

}  // namespace
}  // namespace mbv::synthetic
