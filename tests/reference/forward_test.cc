// Free motion of the reference against closed forms.
#include "reference/forward.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mechanism/reach.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

// A point that slides along x on a spring to the origin's left; free length 0.4 m.
Mechanism SpringMass(double mass, double stiffness, double damping) {
  Mechanism m;
  m.name = "spring_mass";
  m.gravity_W.setZero();
  m.bodies = {MakeWorld(), MakeBody("mass", mass, Vec3::Zero(), Vec3::Constant(0.01))};
  m.joints = {MakeJoint("slide", JointKind::kPrismatic, 0, Vec3::Zero(), 1, Vec3::Zero())};
  m.joints[0].axis = Vec3::UnitX();
  m.springs = {{.name = "spring",
                .body_from = 0,
                .p_from = Vec3(-0.4, 0, 0),
                .body_to = 1,
                .stiffness = stiffness,
                .damping = damping,
                .free_length_m = 0.4}};
  Drive motor;
  motor.name = "motor";
  motor.kind = JointDrive{0, 0};
  m.drives = {motor};
  FinishTree(&m);
  return m;
}

// What tolerance 1e-12 per step leaves after some hundred steps.
constexpr double kIntegrated = 1e-9;

TEST(Forward, AMassOnASpringSwingsLikeACosine) {
  const double mass = 2.0, k = 50.0, x0 = 0.1, w = std::sqrt(k / mass);
  const Mechanism m = SpringMass(mass, k, 0.0);
  const ForwardRun run = RunForwardReference(m, FreeMotion(m, x0, 0.0, 5.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto x = ColumnOf(run.trace, "motor.position"), v = ColumnOf(run.trace, "motor.velocity");
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const double t = run.trace.time_s[i];
    EXPECT_NEAR(x[i], x0 * std::cos(w * t), kIntegrated) << t;
    EXPECT_NEAR(v[i], -x0 * w * std::sin(w * t), 10 * kIntegrated) << t;
  }
  const VecX energy = ColumnOf(run.trace, "energy.kinetic") +
                      ColumnOf(run.trace, "energy.gravity") + ColumnOf(run.trace, "energy.springs");
  EXPECT_NEAR(energy.maxCoeff(), 0.5 * k * x0 * x0, kIntegrated);
  EXPECT_NEAR(energy.minCoeff(), 0.5 * k * x0 * x0, kIntegrated);
}

// Long before the steps are spent: the rate of the spring reports what the rest would take.
TEST(Forward, AnIntegrationThatWouldTakeTooLongIsGivenUpEarly) {
  const Mechanism m = SpringMass(1.0, 1e8, 0.0);
  std::vector<double> reported;
  const ForwardRun run =
      RunForwardReference(m, FreeMotion(m, 0.1, 0.0, 60.0),
                          {.progress = [&](double fraction) { reported.push_back(fraction); }});
  EXPECT_EQ(run.summary.stop, Stop::kNoConvergence);
  EXPECT_NE(run.summary.message.find("spring 'spring' lets the mechanism move at 1e+04 rad/s"),
            std::string::npos)
      << run.summary.message;
  EXPECT_GT(run.summary.time_s, 0.0);
  EXPECT_LE(run.steps, 1000);
  ASSERT_FALSE(reported.empty());
  EXPECT_TRUE(std::is_sorted(reported.begin(), reported.end()));
  EXPECT_LT(reported.back(), 1.0 / 3.0);
}

TEST(Forward, WhatTheStepsSufficeForIsIntegratedToItsEnd) {
  // Steps between the estimate's moments end at the bound itself.
  const Mechanism m = SpringMass(1.0, 1e8, 0.0);
  const ForwardRun spent = RunForwardReference(m, FreeMotion(m, 0.1, 0.0, 0.05),
                                               {.measure_trust = false, .spare_steps = 500});
  EXPECT_NE(spent.summary.message.find("a stiff spring at a small mass"), std::string::npos)
      << spent.summary.message;
  // What is sampled as finely as it moves has as many steps as it has samples.
  const Mechanism soft = SpringMass(1.0, 100.0, 0.0);
  EXPECT_TRUE(
      RunForwardReference(soft, FreeMotion(soft, 0.1, 0.0, 5.0), {.spare_steps = 1}).summary.ok());
  // A vibration that fades: at its first pace the steps would not do, and they do.
  const Mechanism damped = SpringMass(1.0, 1e8, 400.0);
  const Motion fading = FreeMotion(damped, 0.1, 0.0, 0.5);
  const ForwardRun all = RunForwardReference(damped, fading, {.measure_trust = false});
  ASSERT_TRUE(all.summary.ok()) << all.summary.message;
  EXPECT_GT(all.steps, 2000);
  const long tried = all.evaluations / 13, needed = tried + tried / 10;  // stages of a step
  EXPECT_TRUE(RunForwardReference(damped, fading, {.measure_trust = false, .spare_steps = needed})
                  .summary.ok());
}

TEST(Forward, ADampedMassFollowsItsClosedForm) {
  const double mass = 2.0, k = 50.0, c = 3.0, x0 = 0.1, v0 = 0.4;
  const Mechanism m = SpringMass(mass, k, c);
  const ForwardRun run = RunForwardReference(m, FreeMotion(m, x0, v0, 3.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double d = c / (2 * mass), w = std::sqrt(k / mass - d * d);
  const auto x = ColumnOf(run.trace, "motor.position");
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const double t = run.trace.time_s[i];
    const double exact =
        std::exp(-d * t) * (x0 * std::cos(w * t) + (v0 + d * x0) / w * std::sin(w * t));
    EXPECT_NEAR(x[i], exact, kIntegrated) << t;
  }
  // Mutation: 0.1 % more stiffness is seen at once.
  const Mechanism perturbed = SpringMass(mass, 1.001 * k, c);
  const ForwardRun wrong = RunForwardReference(perturbed, FreeMotion(perturbed, x0, v0, 3.0));
  EXPECT_GT((ColumnOf(wrong.trace, "motor.position") - x).cwiseAbs().maxCoeff(), 1e4 * kIntegrated);
}

TEST(Forward, AConstantForceAcceleratesAMassEvenly) {
  const Mechanism m = SpringMass(2.0, 0.0, 0.0);
  Motion motion = FreeMotion(m, 0.0, 0.0, 2.0);
  motion.forces[0].force = Constant(3.0);
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_NEAR(ColumnOf(run.trace, "motor.position").tail<1>()[0], 0.5 * 1.5 * 4.0, kIntegrated);
  EXPECT_NEAR(At(run.trace, 7, "motor.force"), 3.0, 0.0);
  EXPECT_NEAR(ColumnOf(run.trace, "motor.work").tail<1>()[0], 3.0 * 3.0, kIntegrated);
  // Samples set the steps here and the solution is a polynomial; still it is not exact.
  EXPECT_GT(run.uncertainty, 0.0);
  EXPECT_LT(run.uncertainty, kIntegrated);
}

// Samples are periods of the force, or a fraction of one: no stage of a step shows by itself what
// happens between.
TEST(Forward, AForceOfTimeAloneIsFollowedBetweenSamples) {
  const double mass = 2.0, v0 = 2.5;
  const Mechanism m = SpringMass(mass, 0.0, 0.0);
  for (const double frequency : {5.0, 20.0, 63.0, 200.0}) {
    Motion motion = FreeMotion(m, 0.0, v0, 0.6);
    motion.forces[0].force = {{SineTerm{100.0, frequency, 0.0}}};
    const ForwardRun run = RunForwardReference(m, motion);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const double w = 2.0 * std::numbers::pi * frequency, a = 100.0 / mass;
    const auto x = ColumnOf(run.trace, "motor.position");
    double error = 0.0;
    for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
      const double t = run.trace.time_s[i];
      error = std::max(error, std::abs(x[i] - v0 * t - a / w * (t - std::sin(w * t) / w)));
    }
    EXPECT_LT(error, kIntegrated) << frequency;
    EXPECT_LT(run.uncertainty, kIntegrated) << frequency;
  }
}

TEST(Forward, WorkAndEnergyBalanceWithDamperAndMotor) {
  const Mechanism m = SpringMass(2.0, 50.0, 3.0);
  Motion motion = FreeMotion(m, 0.1, 0.4, 3.0);
  motion.forces[0].force = {{SineTerm{4.0, 0.7, 0.0}}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX energy = ColumnOf(run.trace, "energy.kinetic") + ColumnOf(run.trace, "energy.springs");
  const VecX motor = ColumnOf(run.trace, "motor.work"),
             damper = ColumnOf(run.trace, "dampers.work");
  const VecX drift = (energy.array() - energy[0]).matrix() - motor - damper;
  EXPECT_LT(drift.cwiseAbs().maxCoeff(), kIntegrated);
  EXPECT_LT(damper.maxCoeff(), 1e-12);
  // Mutation: a thousandth of the motor's work is far above that.
  EXPECT_GT((drift - 1e-3 * motor).cwiseAbs().maxCoeff(), 1e4 * kIntegrated);
}

TEST(Forward, AParallelogramTurnsEvenlyThroughItsFlatPoses) {
  const double start = 1.0, rate = 2.5;
  const Mechanism m = MakeParallelogram(start);
  const ForwardRun run = RunForwardReference(m, FreeMotion(m, start, rate, 5.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message << run.summary.time_s;
  const auto angle = ColumnOf(run.trace, "motor.position");
  // A bridge may change the energy by 1e-8 of what it is, and so the rate by half of that.
  constexpr double kBridged = 0.5e-8;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const double turned = rate * run.trace.time_s[i];
    const double bridges = std::floor((start + turned) / std::numbers::pi);
    EXPECT_NEAR(angle[i], start + turned, kIntegrated + bridges * kBridged * turned) << i;
  }
  // Flat at π, 2π, 3π, 4π.
  ASSERT_EQ(run.singular.size(), 4u);
  for (size_t k = 0; k < 4; ++k) {
    EXPECT_TRUE(run.singular[k].passed);
    EXPECT_NEAR(run.singular[k].time_s, ((k + 1.0) * std::numbers::pi - start) / rate, 1e-6);
    EXPECT_FALSE(run.singular[k].joint.empty());
  }
}

// Turned as a whole by 64.6°, its crank is flat at 244.6° in the world: among the nodes of the
// bridge its quaternion, which is reported from the rotation, changes its sign (at 240°).
TEST(Forward, ABridgeGoesOnWhereAQuaternionChangesItsSign) {
  const double start = 1.0, rate = 2.5, turned = 240.0 / 180.0 * std::numbers::pi + 0.08;
  Mechanism m = MakeParallelogram(start);
  const Mat3 R = RotZ(turned - std::numbers::pi);
  for (Joint& joint : m.joints) {
    if (joint.parent == 0) joint.X_PF = Pose(Pose(R) * joint.X_PF);
  }
  for (size_t b = 1; b < m.X_WB_home.size(); ++b) m.X_WB_home[b] = Pose(R) * m.X_WB_home[b];
  const ForwardRun run = RunForwardReference(m, FreeMotion(m, start, rate, 1.5));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  ASSERT_EQ(run.singular.size(), 1u);
  EXPECT_NEAR(ColumnOf(run.trace, "motor.position").tail<1>()[0], start + rate * 1.5, 2e-8);
  // The bridge is as long as elsewhere: no steps go nearer to the pose in search of a shorter one.
  const Mechanism upright = MakeParallelogram(start);
  const ForwardRun same = RunForwardReference(upright, FreeMotion(upright, start, rate, 1.5));
  EXPECT_LE(run.steps, same.steps + 2);
}

// Of J = 0.08 kg m²: q̈ = τ/J. What oscillates faster than a bridge follows is not passed in
// silence: a shorter bridge is found, or the run ends at the pose.
TEST(Forward, AParallelogramUnderAnOscillatingTorqueFollowsItOrStops) {
  const double start = 2.5, rate = 2.5, inertia = 0.08;
  const Mechanism m = MakeParallelogram(start);
  constexpr double kMoved = 1e-7;  // what a bridge may be off its loops
  int followed = 0;
  for (const double frequency : {1.0, 5.0, 20.0, 40.0, 63.0, 80.0, 100.0, 160.0, 200.0}) {
    for (const double torque : {0.01, 1.0, 5.0}) {
      Motion motion = FreeMotion(m, start, rate, 0.6);
      motion.forces[0].force = {{SineTerm{torque, frequency, 0.0}}};
      const ForwardRun run = RunForwardReference(m, motion);
      const double w = 2.0 * std::numbers::pi * frequency, a = torque / inertia;
      const auto angle = ColumnOf(run.trace, "motor.position");
      double error = 0.0;
      for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
        const double t = run.trace.time_s[i];
        if (std::isnan(angle[i])) break;
        error = std::max(error,
                         std::abs(angle[i] - start - rate * t - a / w * (t - std::sin(w * t) / w)));
      }
      EXPECT_LT(error, kMoved) << frequency << " Hz, " << torque << " N m";
      if (!run.summary.ok()) {
        EXPECT_EQ(run.summary.stop, Stop::kSingular) << run.summary.message;
        continue;
      }
      ++followed;
      // A bridge may change the energy, and the work, by 1e-8 of what there is.
      const VecX kinetic = ColumnOf(run.trace, "energy.kinetic");
      const double work = ColumnOf(run.trace, "motor.work").tail<1>()[0];
      const double bridges = static_cast<double>(run.singular.size());
      const double most = (1e-8 * bridges + kIntegrated) * kinetic.maxCoeff();
      EXPECT_LT(std::abs(kinetic.tail<1>()[0] - kinetic[0] - work), most)
          << frequency << " Hz, " << torque << " N m";
      const double end = rate + a / w * (1.0 - std::cos(w * motion.duration_s));
      EXPECT_NEAR(work, 0.5 * inertia * (end * end - rate * rate), most)
          << frequency << " Hz, " << torque << " N m";
    }
  }
  EXPECT_GE(followed, 9);
}

TEST(Forward, AStartInASingularPoseIsReportedAtOnce) {
  const Mechanism m = MakeParallelogram(1.0);
  const ForwardRun run = RunForwardReference(m, FreeMotion(m, 0.0, 2.0, 1.0));
  EXPECT_EQ(run.summary.stop, Stop::kSingular) << run.summary.message;
  EXPECT_EQ(run.summary.time_s, 0.0);
  EXPECT_FALSE(run.summary.where.empty());
  EXPECT_FALSE(std::isnan(run.summary.amount));
}

TEST(Forward, APairOfDrivesSharesATorqueByLeastNorm) {
  const Mechanism m = MakeSharedArm();
  Motion motion;
  motion.duration_s = 0.0;
  motion.commands = {
      DriveCommand(m, 0, {{SineTerm{0.3, 0.5, std::numbers::pi / 2}, ConstantTerm{-0.3}}})};
  const ReferenceRun run = RunReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double torque = -2.0 * 0.3 * std::numbers::pi * std::numbers::pi;
  const double L = CharacteristicLength(m);
  const double f = 0.5 * torque / (L * L + 0.25);
  EXPECT_NEAR(At(run.trace, 0, "leg.force"), f, 1e-12);
  EXPECT_NEAR(At(run.trace, 0, "motor.force"), torque - 0.5 * f, 1e-12);
  EXPECT_GT(std::abs(f), 1.0);
}

TEST(Forward, AFloatingBodyFliesAParabolaAndKeepsItsSpin) {
  const Mechanism m = MakeFloater();
  Vec6 rates;
  rates << 0.3, -0.2, 4.0, 0.0, 0.0, 2.0;
  const ForwardRun run = RunForwardReference(m, FloatFree(rates, 0.5));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const Eigen::Index last = run.trace.values.rows() - 1;
  EXPECT_NEAR(At(run.trace, last, "body.x"), 0.15, kIntegrated);
  EXPECT_NEAR(At(run.trace, last, "body.z"), 2.0 - 0.5 * 9.81 * 0.25, kIntegrated);
  EXPECT_NEAR(At(run.trace, last, "body.yaw"), 1.0, kIntegrated);
  EXPECT_NEAR(At(run.trace, last, "body.x.velocity"), 0.3, kIntegrated);
  EXPECT_NEAR(At(run.trace, last, "body.z.velocity"), 4.0 - 9.81 * 0.5, kIntegrated);
  EXPECT_NEAR(At(run.trace, last, "body.yaw.velocity"), 2.0, kIntegrated);
  EXPECT_NEAR(At(run.trace, last, "body.z.acceleration"), -9.81, kIntegrated);
  const VecX energy = ColumnOf(run.trace, "energy.kinetic") + ColumnOf(run.trace, "energy.gravity");
  EXPECT_LT((energy.array() - energy[0]).abs().maxCoeff(), kIntegrated);
}

TEST(Forward, AFloatingBodyHangsOnASpringAndIsPushedByALeg) {
  Mechanism m = MakeFloater();
  m.gravity_W.setZero();
  const double k = 50.0, w = std::sqrt(k / 2.0), push = 0.5;
  m.springs = {{.name = "spring",
                .body_from = 0,
                .p_from = Vec3(-0.4, 0, 0),
                .body_to = 1,
                .stiffness = k,
                .free_length_m = 0.4}};
  Drive leg;
  leg.name = "leg";
  leg.kind = DistanceDrive{0, Vec3(-1, 0, 0), 1, Vec3::Zero()};
  m.drives = {leg};
  Motion motion = FloatFree(Vec6::Zero(), 1.0);
  motion.forces = {{0, Constant(push)}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX x = ColumnOf(run.trace, "body.x");
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    EXPECT_NEAR(x[i], push / k * (1 - std::cos(w * run.trace.time_s[i])), kIntegrated) << i;
  }
  EXPECT_NEAR(ColumnOf(run.trace, "leg.work").tail<1>()[0], push * x.tail<1>()[0], kIntegrated);
}

TEST(Forward, APendulumReturnsAfterThePeriodOfTheEllipticIntegral) {
  const double length = 1.2, g = 9.81, amplitude = 2.5;
  Mechanism m;
  m.name = "pendulum";
  m.gravity_W = Vec3(0, 0, -g);
  // Nearly a point mass at the end: I about the pivot is m l² + 1e-4.
  m.bodies = {MakeWorld(), MakeBody("bob", 1.0, Vec3(0, 0, -length), Vec3::Constant(1e-4))};
  m.joints = {MakeJoint("pivot", JointKind::kRevolute, 0, Vec3::Zero(), 1, Vec3::Zero())};
  m.joints[0].axis = Vec3::UnitY();
  FinishTree(&m);
  const double w = std::sqrt(g * length / (length * length + 1e-4));
  const double period = 4.0 / w * std::comp_ellint_1(std::sin(amplitude / 2));
  Motion motion = FreeMotion(m, amplitude, 0.0, 3 * period);
  motion.sample_s = period / 100;
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  // The pivot's force at the turning points is that of the start.
  for (const char* channel : {"pivot.reaction.fx", "pivot.reaction.fz"}) {
    EXPECT_NEAR(At(run.trace, 300, channel), At(run.trace, 0, channel), 1e-8) << channel;
  }
  EXPECT_LT(run.uncertainty, 1e-8);
  EXPECT_GT(run.growth, 1.0);
  EXPECT_LT(run.growth, 100.0);
}

}  // namespace
}  // namespace mbv::fixtures
