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
  return MotorLoadOf("d1", motor, trace, {.load_inertia = 12.0});
}

double UseOf(const std::vector<MotorLoad::Use>& uses, const std::string& of) {
  for (const MotorLoad::Use& use : uses) {
    if (use.of == of) return use.use;
  }
  return kNan;
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
  const auto use = [&](const std::string& of) { return UseOf(load.uses, of); };
  EXPECT_NEAR(use("speed"), 0.75, 1e-12);
  EXPECT_NEAR(use("rated speed"), 2 * kV / pi / 25.0, 1e-5);
  EXPECT_NEAR(use("continuous current"), kA / std::sqrt(2.0) / 0.5 / 4.0, 1e-12);
  EXPECT_NEAR(use("peak current"), kA / 0.5 / 5.0, 1e-12);
  EXPECT_NEAR(use("voltage"), (2.0 * 4.0 + 0.5 * 30.0) / 25.0, 1e-12);
  EXPECT_STREQ(load.limited_by(), "voltage");
}

// A winding that a torque heats for `on_s` of every `period_s`: R = 2 Ω, k_t = 0.5.
struct RepeatedStep {
  double on_s = 12.0, period_s = 30.0, torque = 3.0;

  [[nodiscard]] double loss_W() const { return 2.0 * torque * torque / 0.25; }
  // The torque ends within 1e-9 s: the trapezoidal rule heats by as much too long, at most.
  [[nodiscard]] Trace ToTrace() const {
    std::vector<double> times;
    for (int i = 0; i <= 12; ++i) times.push_back(on_s * i / 12.0);
    times.push_back(on_s + 1e-9);
    for (int i = 1; i <= 6; ++i) times.push_back(on_s + (period_s - on_s) * i / 6.0);
    Trace trace;
    trace.Reset(times, DriveChannels(synthetic::TwoSliders()));
    trace.values.setZero();
    trace.values.col(trace.Find("d1.force")).head(13).setConstant(torque);
    return trace;
  }
};

Motor Heated() {
  Motor motor = Plain();
  motor.torque_constant = 0.5;
  motor.resistance = 2.0;
  motor.thermal = MotorThermal{.winding_to_housing = 0.8,
                               .housing_to_ambient = 2.0,
                               .winding_time = 20.0,
                               .housing_time = 600.0,
                               .ambient_C = 30.0,
                               .max_winding_C = 130.0};
  return motor;
}

// The closed form: a step of the loss P heats the winding by P Σ a_k (1 − e^(−t/T_k)), with the
// roots 1/T_k of the network's characteristic polynomial. Of steps that repeat for ever, what they
// leave at their ends is a geometric series: P Σ a_k (1 − e^(−on/T_k)) / (1 − e^(−period/T_k)).
double RepeatedStepPeak(const RepeatedStep& step, const MotorThermal& t) {
  const double R1 = t.winding_to_housing, R2 = t.housing_to_ambient;
  const double C1 = t.winding_time / R1, C2 = t.housing_time / R2;
  const double b = 1 / (R1 * C1) + 1 / (R1 * C2) + 1 / (R2 * C2), c = 1 / (R1 * C1 * R2 * C2);
  const double root = std::sqrt(b * b - 4 * c);
  const double s1 = (b + root) / 2, s2 = (b - root) / 2;
  // Step response with w(∞) = R1 + R2 and w'(0) = 1/C1.
  const double a2 = (1 / C1 - s1 * (R1 + R2)) / (s2 - s1), a1 = R1 + R2 - a2;
  const auto share = [&](double s) {
    return (1 - std::exp(-s * step.on_s)) / (1 - std::exp(-s * step.period_s));
  };
  return t.ambient_C + step.loss_W() * (a1 * share(s1) + a2 * share(s2));
}

TEST(MotorLoad, ARepeatedStepHeatsTheWindingAsItsClosedFormDoes) {
  const RepeatedStep step;
  const Motor motor = Heated();
  const double peak = RepeatedStepPeak(step, *motor.thermal);
  const MotorLoad load = LoadOf(motor, step.ToTrace());
  // 1e-9 s of the loss too much per 30 s: 1e-9 of the rise, and round-off.
  const double tolerance = 2e-9 * (peak - 30.0);
  EXPECT_NEAR(load.winding_peak_C, peak, tolerance);
  EXPECT_NEAR(UseOf(load.uses, "winding temperature"), (peak - 30.0) / 100.0, tolerance / 100.0);
  EXPECT_LT(load.housing_peak_C, load.winding_peak_C);
  // A perturbed network is not it.
  for (double MotorThermal::*number :
       {&MotorThermal::winding_to_housing, &MotorThermal::housing_to_ambient,
        &MotorThermal::winding_time, &MotorThermal::housing_time}) {
    Motor other = motor;
    (*other.thermal).*number *= 1.0 + 1e-4;
    EXPECT_GT(std::abs(LoadOf(other, step.ToTrace()).winding_peak_C - peak), 2 * tolerance);
  }
}

// Constant torque: w = (R1 + R2) P (1 + α (w − 25 + ambient)): losses grow, and run away where the
// loop gain α P (R1 + R2) reaches 1.
TEST(MotorLoad, LossesGrowWithTheWindingUntilTheyRunAway) {
  Motor motor = Heated();
  motor.thermal->resistance_growth = 0.0039;
  for (const double gain : {0.5, 0.99, 1.0, 1.01}) {
    const double loss_W = gain / (0.0039 * 2.8);
    const RepeatedStep step{
        .on_s = 29.0, .period_s = 30.0, .torque = 0.5 * std::sqrt(loss_W / 2.0)};
    Trace trace = step.ToTrace();
    trace.values.col(trace.Find("d1.force")).setConstant(step.torque);
    const MotorLoad load = LoadOf(motor, trace);
    if (gain >= 1.0) {
      EXPECT_TRUE(std::isinf(load.winding_peak_C) || load.winding_peak_C > 1e9) << gain;
      EXPECT_LT(load.margin(), 1e-6);
      EXPECT_GT(load.overheated_s, 0.0);
      continue;
    }
    const double rise = 2.8 * loss_W * (1.0 + 0.0039 * (30.0 - 25.0)) / (1.0 - gain);
    EXPECT_NEAR(load.winding_peak_C, 30.0 + rise, 1e-8 * rise) << gain;
  }
}

// The time from ambient temperature to the limit, by stepping cycle after cycle.
TEST(MotorLoad, TheTimeToTheLimitIsFound) {
  const RepeatedStep step;
  Motor motor = Heated();
  const double peak = LoadOf(motor, step.ToTrace()).winding_peak_C;
  EXPECT_TRUE(std::isnan(LoadOf(motor, step.ToTrace()).overheated_s) == (peak <= 130.0));
  motor.thermal->max_winding_C = 30.0 + 0.9 * (peak - 30.0);
  const double found_s = LoadOf(motor, step.ToTrace()).overheated_s;
  // Explicit Euler with steps of 1 ms, at the samples of the step: one a second while it heats.
  double w = 0.0, h = 0.0, t_s = 0.0;
  const double C1 = 20.0 / 0.8, C2 = 600.0 / 2.0;
  for (long k = 0; w + 30.0 <= motor.thermal->max_winding_C; ++k) {
    t_s = static_cast<double>(k) * 1e-3;
    const double P = std::fmod(t_s, 30.0) < 12.0 ? step.loss_W() : 0.0;
    const double flow = (w - h) / 0.8;
    w += 1e-3 * (P - flow) / C1;
    h += 1e-3 * (flow - h / 2.0) / C2;
  }
  EXPECT_GE(found_s, t_s - 0.1);
  EXPECT_LE(found_s, t_s + 1.1);
}

// v = V sin, F = A sin: the mean of power p over revolutions is A (∫ sin^(p+1) / ∫ sin)^(1/p); with
// p = 3 over half a period (3π/8)/2.
TEST(MotorLoad, AGearboxBearsPeakMeanAndSpeeds) {
  Motor motor = Plain();
  motor.gear_ratio = 10.0;
  motor.gearbox = MotorGearbox{.mean_torque = 4.0,
                               .peak_torque = 5.0,
                               .emergency_torque = 8.0,
                               .mean_speed = 250.0,
                               .max_speed = 400.0};
  const MotorLoad load = LoadOf(motor, SineTrace());
  const double mean = kA * std::cbrt(3 * pi / 16);
  EXPECT_NEAR(load.gear_mean_torque, mean, 1e-6);
  EXPECT_NEAR(UseOf(load.uses, "gearbox mean torque"), mean / 4.0, 1e-6);
  EXPECT_NEAR(UseOf(load.uses, "gearbox peak"), kA / 5.0, 1e-12);
  EXPECT_NEAR(UseOf(load.uses, "gearbox emergency"), kA / 8.0, 1e-12);
  EXPECT_NEAR(UseOf(load.uses, "gearbox speed"), 10 * kV / 400.0, 1e-12);
  EXPECT_NEAR(UseOf(load.uses, "gearbox mean speed"), 20 * kV / pi / 250.0, 1e-5);
  // ∫ sin^(13/3) = √π Γ(8/3)/Γ(19/6) over half a period; not the mean of power 3.
  motor.gearbox->exponent = 10.0 / 3.0;
  const double integral = std::sqrt(pi) * std::tgamma(8.0 / 3.0) / std::tgamma(19.0 / 6.0);
  const MotorLoad bearing = LoadOf(motor, SineTrace());
  EXPECT_NEAR(bearing.gear_mean_torque, kA * std::pow(integral / 2.0, 0.3), 1e-6);
  EXPECT_GT(bearing.gear_mean_torque - mean, 1e-3);
  // A brake on the motor's shaft stops the drive through the gear.
  motor.efficiency = 0.8;
  motor.brake = MotorBrake{.torque = 0.6};
  EXPECT_NEAR(LoadOf(motor, SineTrace()).gear_emergency_torque, 0.6 * 10 / 0.8, 1e-12);
  // The torque of a gearbox before a spindle.
  motor.spindle = 5.0;
  EXPECT_NEAR(LoadOf(motor, SineTrace()).gear_torque, kA / 5.0, 1e-12);
}

TEST(MotorLoad, ABrakeHoldsAndStops) {
  Motor motor = Plain();
  motor.gear_ratio = 10.0;
  motor.efficiency = 0.8;
  motor.rotor_inertia = 1e-4;
  motor.brake = MotorBrake{.torque = 0.5, .energy = 20.0};
  const Trace trace = SineTrace();
  DriveFacts facts;
  facts.at_rest.force = VecX::Constant(trace.values.rows(), -4.0);
  facts.at_rest.energy_J = 0.5 * 0.02 * trace.values.col(trace.Find("d1.velocity")).cwiseAbs2();
  const MotorLoad load = MotorLoadOf("d1", motor, trace, facts);
  EXPECT_NEAR(load.holding_torque, 4.0 * 0.8 / 10.0, 1e-12);
  EXPECT_NEAR(UseOf(load.uses, "holding brake"), 0.32 / 0.5, 1e-12);
  // Rotor and load at full speed, braked with what is left of 0.5 N m.
  const double energy = (0.5 * 1e-4 * 1e2 + 0.8 * 0.5 * 0.02) * kV * kV * 0.5 / (0.5 - 0.32);
  EXPECT_NEAR(load.stop_energy_J, energy, 1e-9);
  EXPECT_NEAR(UseOf(load.uses, "brake energy"), energy / 20.0, 1e-9);
  // It stops nothing that it does not hold.
  motor.brake->torque = 0.32 * (1 - 1e-9);
  EXPECT_TRUE(std::isinf(MotorLoadOf("d1", motor, trace, facts).stop_energy_J));
  EXPECT_LT(MotorLoadOf("d1", motor, trace, facts).margin(), 1e-12);
  // Nothing is known without the reference.
  EXPECT_TRUE(std::isnan(LoadOf(motor, trace).holding_torque));
}

// A quarter of a period late: per half wave A V T/2π comes back, four of them in two periods.
TEST(MotorLoad, TheLinkKeepsWhatItsCapacitorTakesAndBurnsTheRest) {
  const Trace trace = SineTrace(pi / 2);
  const double half_wave_J = kA * kV / (4 * pi);
  const std::vector<MotorLoad> loads = {LoadOf(Plain(), trace)};
  EXPECT_NEAR(loads[0].fed_back_J, 4 * half_wave_J, 1e-3);
  const auto with_room = [&](double room_J, double efficiency) {
    DcLink link{.efficiency = efficiency,
                .capacitance = room_J > 0.0 ? 1e-3 : 0.0,
                .voltage = 300.0,
                .mean_power = 10.0,
                .peak_power = 40.0};
    link.brake_voltage = std::sqrt(300.0 * 300.0 + 2e3 * room_J);
    return *LinkLoadOf(link, loads);
  };
  const LinkLoad burnt = with_room(0.0, 1.0);
  EXPECT_NEAR(burnt.resistor_J, 4 * half_wave_J, 1e-3);
  EXPECT_NEAR(burnt.resistor_mean, 2 * half_wave_J, 1e-3);
  EXPECT_NEAR(burnt.resistor_peak, 0.5 * kA * kV, 1e-3);
  EXPECT_NEAR(UseOf(burnt.uses, "brake resistor, mean"), 2 * half_wave_J / 10.0, 1e-4);
  EXPECT_NEAR(UseOf(burnt.uses, "brake resistor, peak"), 0.5 * kA * kV / 40.0, 1e-4);
  const LinkLoad half = with_room(0.5 * half_wave_J, 1.0);
  EXPECT_NEAR(half.resistor_J, 2 * half_wave_J, 2e-3);
  EXPECT_NEAR(half.capacitor_J, 2 * half_wave_J, 2e-3);
  const LinkLoad kept = with_room(half_wave_J * 1.001, 1.0);
  EXPECT_EQ(kept.resistor_J, 0.0);
  // Inverters take their share both ways.
  EXPECT_NEAR(with_room(0.0, 0.9).fed_back_J, 0.9 * 4 * half_wave_J, 1e-3);
  EXPECT_NEAR(with_room(0.0, 0.9).drawn_J, 4 * half_wave_J / 0.9, 1e-3);
}

// Copper losses R i² are drawn while the motor brakes, too: P = A V sin cos + R (A cos / k)².
TEST(MotorLoad, LossesTakeFromWhatIsFedBack) {
  Motor motor = Plain();
  motor.torque_constant = 0.5;
  motor.resistance = 1e-4;
  const double lossless = LoadOf(Plain(), SineTrace(pi / 2)).fed_back_J;
  const double less = lossless - LoadOf(motor, SineTrace(pi / 2)).fed_back_J;
  // To first order half of the losses of 2 s, R A²/k²/2 each second.
  EXPECT_NEAR(less, 1e-4 * kA * kA / 0.25 / 2.0, 2e-6);
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
