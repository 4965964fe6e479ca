// What motors are asked for: numbers by hand, gears, curves, and the check of the margin.
#include "comparison/motor_load.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mechanism/channels.h"
#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

using std::numbers::pi;

constexpr double kA = 2.0, kV = 30.0;  // amplitudes: force and speed of the example in the document

// One drive for two periods of 1 s: v = V sin ωt, F = A sin(ωt + phase).
Trace SineTrace(double phase = 0.0, int samples = 4000) {
  std::vector<double> times = SampleTimes(2.0, 2.0 / samples);
  Trace trace;
  trace.witness = "reference";
  trace.Reset(times, DriveChannels(synthetic::TwoSliders()));
  trace.values.setZero();
  for (Eigen::Index i = 0; i < trace.values.rows(); ++i) {
    const double angle = 2 * pi * times[static_cast<size_t>(i)];
    trace.values(i, trace.Find("d1.force")) = kA * std::sin(angle + phase);
    trace.values(i, trace.Find("d1.velocity")) = kV * std::sin(angle);
    trace.values(i, trace.Find("d1.acceleration")) = 2 * pi * kV * std::cos(angle);
  }
  return trace;
}

MotorLoad LoadOf(const Motor& motor, const Trace& trace) {
  return MotorLoadOf(synthetic::TwoSliders(), motor, trace, 12.0);
}

Motor Plain() {
  Motor motor;
  motor.drive = 0;
  motor.continuous = 1.8;
  motor.peak = 2.5;
  return motor;
}

// The trapezoidal rule over whole periods of sines is exact; of |sin| it is of second order.
TEST(MotorLoad, ASineAsksForItsAmplitudeOverTheRootOfTwo) {
  const MotorLoad load = LoadOf(Plain(), SineTrace());
  EXPECT_NEAR(load.rms_torque, kA / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(load.mean_torque, 0.0, 1e-12);
  EXPECT_NEAR(std::abs(load.peak_torque), kA, 1e-12);
  EXPECT_NEAR(load.mean_speed, 2 * kV / pi, 1e-4);
  EXPECT_NEAR(load.peak_speed, kV, 1e-12);
  EXPECT_NEAR(load.peak_power, kA * kV, 1e-10);
  EXPECT_NEAR(load.peak_brake_power, 0.0, 1e-12);
  EXPECT_NEAR(load.energy_J, kA * kV, 1e-10);  // two periods of A V T/2
  EXPECT_NEAR(load.brake_energy_J, 0.0, 1e-12);
  ASSERT_EQ(load.uses.size(), 2u);
  EXPECT_NEAR(load.uses[0].use, 0.8, 1e-12);                        // peak: 2/2.5
  EXPECT_NEAR(load.uses[1].use, kA / std::sqrt(2.0) / 1.8, 1e-12);  // continuous
  EXPECT_NEAR(load.margin(), 1.25, 1e-12);
  EXPECT_STREQ(load.limited_by(), "peak");
  // At rest around three zeros of four periods only.
  EXPECT_NEAR(load.duty, 1.0 - 2 * std::asin(0.01) / pi, 2e-3);
  EXPECT_NEAR(load.above_continuous, 1.0 - 2 * std::asin(0.9) / pi, 2e-3);
}

// Of A sin, half of the time on each side: a motor of one side has a margin of 0 unless its side is
// all that is asked for, and each side counts by itself.
TEST(MotorLoad, SidesCountByThemselves) {
  const double none = Motor::kNoLimit;
  struct Case {
    double least, most, use;
  };
  for (const Case& c : {Case{-none, 2.5, kA / 2.5},
                        {-2.5, none, kA / 2.5},
                        {-4, 2.5, kA / 2.5},
                        {-2.5, 4, kA / 2.5},
                        {0, 2.5, none},
                        {-2.5, 0, none},
                        {1, 2.5, none}}) {
    Motor motor;
    motor.drive = 0;
    motor.least = c.least;
    motor.most = c.most;
    const MotorLoad load = LoadOf(motor, SineTrace());
    ASSERT_EQ(load.uses.size(), 1u);
    if (std::isinf(c.use)) {
      EXPECT_EQ(load.margin(), 0.0) << c.least;
    } else {
      EXPECT_NEAR(load.largest_use(), c.use, 1e-12) << c.least;
    }
  }
  // Pulling only: what is round-off of the other side is nothing, twice that is asked for.
  Trace pulls = SineTrace();
  const int force = pulls.Find("d1.force");
  ASSERT_GE(force, 0);
  pulls.values.col(force) = pulls.values.col(force).cwiseAbs();
  Motor cable;
  cable.drive = 0;
  cable.least = 0.0;
  cable.most = 2.5;
  for (const double back : {-0.5e-9, -2e-9}) {
    pulls.values(0, force) = back * kA;
    const MotorLoad load = LoadOf(cable, pulls);
    if (back < -1e-9) {
      EXPECT_EQ(load.margin(), 0.0);
    } else {
      EXPECT_NEAR(load.margin(), 2.5 / kA, 1e-9);
    }
  }
}

// A quarter of a period late: as much energy comes back as goes in, A V T/2π per half wave.
TEST(MotorLoad, PowerHasBothSigns) {
  const MotorLoad load = LoadOf(Plain(), SineTrace(pi / 2));
  EXPECT_NEAR(load.peak_power, 0.5 * kA * kV, 1e-9);
  EXPECT_NEAR(load.peak_brake_power, -0.5 * kA * kV, 1e-9);
  EXPECT_NEAR(load.energy_J, kA * kV / pi, 1e-3);
  EXPECT_NEAR(load.brake_energy_J, -kA * kV / pi, 1e-3);
}

TEST(MotorLoad, TheGearDividesTorqueAndMultipliesSpeed) {
  Motor motor = Plain();
  motor.gear_ratio = 10.0;
  motor.efficiency = 0.8;
  const MotorLoad load = LoadOf(motor, SineTrace());
  EXPECT_NEAR(load.rms_torque, kA / std::sqrt(2.0) / 10.0 / 0.8, 1e-12);
  EXPECT_NEAR(load.peak_speed, 10 * kV, 1e-11);
  // Where it brakes all the time, losses help.
  const MotorLoad braking = LoadOf(motor, SineTrace(pi));
  EXPECT_NEAR(braking.rms_torque, kA / std::sqrt(2.0) / 10.0 * 0.8, 1e-12);
  motor.gear_ratio = 1.0;
  EXPECT_NEAR(LoadOf(motor, SineTrace()).margin(), 1.0, 1e-12);  // 2/0.8 of 2.5
}

// τ = A sin + J n² 2π V cos at n = 1: amplitudes add at right angles.
TEST(MotorLoad, TheRotorAsksForItsOwnAcceleration) {
  Motor motor = Plain();
  motor.rotor_inertia = 0.01;
  const MotorLoad load = LoadOf(motor, SineTrace());
  EXPECT_NEAR(load.rms_torque, std::hypot(kA, 0.01 * 2 * pi * kV) / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(load.inertia_ratio, 12.0 / 0.01, 1e-9);
  motor.gear_ratio = 2.0;
  EXPECT_NEAR(LoadOf(motor, SineTrace()).rms_torque,
              std::hypot(kA / 2, 0.01 * 2 * 2 * pi * kV) / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(LoadOf(motor, SineTrace()).inertia_ratio, 12.0 / 0.04, 1e-9);
}

// The continuous torque is that of the speed of every instant: with a curve that falls from 2.5 at
// rest to 0.5 at V, |A sin| is above 2.5 − 2 |sin| where |sin| > 0.625; it is never above 2.5.
TEST(MotorLoad, TheContinuousTorqueIsThatOfTheSpeedOfEveryInstant) {
  Motor motor;
  motor.drive = 0;
  motor.continuous_curve = {{0.0, 2.5}, {kV, 0.5}};
  EXPECT_NEAR(LoadOf(motor, SineTrace()).above_continuous, 1.0 - 2 * std::asin(0.625) / pi, 2e-3);
  // A quarter of a period late: 2 |cos| > 2.5 − 2 |sin|, where |sin| + |cos| > 1.25.
  const double edge = std::asin(1.25 / std::sqrt(2.0)) - pi / 4;
  EXPECT_NEAR(LoadOf(motor, SineTrace(pi / 2)).above_continuous, 1.0 - 4 * edge / pi, 2e-3);
}

TEST(MotorLoad, CurvesAreStraightBetweenTheirPointsAndEnd) {
  Motor motor;
  motor.peak_curve = {{0.0, 4.0}, {20.0, 4.0}, {40.0, 2.0}};
  EXPECT_DOUBLE_EQ(PeakTorque(motor, -30.0), 3.0);
  EXPECT_DOUBLE_EQ(PeakTorque(motor, 40.0), 2.0);
  EXPECT_DOUBLE_EQ(PeakTorque(motor, 40.1), 0.0);
  motor.max_speed = 25.0;
  EXPECT_DOUBLE_EQ(PeakTorque(motor, 26.0), 0.0);
  motor.drive = 0;
  motor.max_speed = Motor::kNoLimit;
  // At v = V sin = 30, F = 2: of 3. The largest share of all speeds.
  EXPECT_NEAR(LoadOf(motor, SineTrace()).largest_use(), 2.0 / 3.0, 1e-9);
  motor.peak_curve.back() = {29.0, 2.0};  // faster than the curve goes
  EXPECT_TRUE(std::isinf(LoadOf(motor, SineTrace()).largest_use()));
}

TEST(MotorLoad, SpeedsCurrentsAndVoltageAreLimits) {
  Motor motor = Plain();
  motor.max_speed = 40.0;
  motor.rated_speed = 25.0;
  motor.torque_constant = 0.5;
  motor.resistance = 2.0;
  motor.voltage = 25.0;
  motor.continuous_current = 4.0;
  motor.peak_current = 5.0;
  const MotorLoad load = LoadOf(motor, SineTrace());
  const auto use = [&](const std::string& of) {
    for (const MotorLoad::Use& u : load.uses) {
      if (u.of == of) return u.use;
    }
    return kNan;
  };
  EXPECT_NEAR(use("speed"), 0.75, 1e-12);
  EXPECT_NEAR(use("rated speed"), 2 * kV / pi / 25.0, 1e-5);
  EXPECT_NEAR(use("continuous current"), kA / std::sqrt(2.0) / 0.5 / 4.0, 1e-12);
  EXPECT_NEAR(use("peak current"), kA / 0.5 / 5.0, 1e-12);
  EXPECT_NEAR(use("voltage"), (2.0 * 4.0 + 0.5 * 30.0) / 25.0, 1e-12);
  EXPECT_STREQ(load.limited_by(), "voltage");
}

// The drives of three witnesses that agree: 100 N at most on d1.
synthetic::Case CaseWithMotor(double peak, double margin) {
  synthetic::Case c;
  Motor motor;
  motor.drive = 0;
  motor.turns = false;
  motor.peak = peak;
  c.mechanism.motors = {motor};
  const double use = 1.0 / margin;
  c.limits[Metric::kMotorUse] = {use, use, use, use};
  return c;
}

TEST(MotorLoad, TheMarginIsJudgedAndFailsJustBelow) {
  const double largest =
      LoadOf(CaseWithMotor(1.0, 1.0).mechanism.motors[0], synthetic::ExactTrace("analytic"))
          .largest_use();
  ASSERT_NEAR(largest, 100.0, 1.0);
  const Comparison good = CaseWithMotor(1.2 * largest * (1 + 1e-9), 1.2).Run();
  EXPECT_EQ(good.verdict, Verdict::kAgree) << good.reason;
  const Comparison bad = CaseWithMotor(1.2 * largest * (1 - 1e-9), 1.2).Run();
  EXPECT_EQ(bad.verdict, Verdict::kDisagree) << bad.reason;
  EXPECT_EQ(bad.attribution.odd_one_out, "");
  EXPECT_NE(bad.attribution.text.find("the motor of d1 has a margin of 1.2 where 1.2 is required"),
            std::string::npos)
      << bad.attribution.text;
}

TEST(MotorLoad, WithoutARequiredMarginNothingIsJudged) {
  synthetic::Case c = CaseWithMotor(1.0, 1.2);
  c.limits[Metric::kMotorUse] = {};
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << comparison.reason;
  for (const CheckResult& check : comparison.checks) {
    EXPECT_NE(check.metric, Metric::kMotorUse);
  }
}

}  // namespace
}  // namespace mbv
