// Coupled joints in MuJoCo against an equation of motion by hand.
#include <gtest/gtest.h>

#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"
#include "simulation/mjcf/plan.h"
#include "tests/mechanisms/coupled_wheels.h"
#include "tests/simulation/torque_error.h"

namespace mbv {
namespace {

using fixtures::CoupledWheels;

Motion FourSeconds() { return {.duration_s = 4.0, .sample_s = 0.02, .commands = {}, .loads = {}}; }

// Through several turns: 9 t + 3 sin 2t.
RunSummary Turning(double t, DrivenSample* driven) {
  driven->position = VecX::Constant(1, 9 * t + 3 * std::sin(2 * t));
  driven->velocity = VecX::Constant(1, 9 + 6 * std::cos(2 * t));
  driven->acceleration = VecX::Constant(1, -12 * std::sin(2 * t));
  return RunSummary::Done();
}

TEST(SimulatedCoupling, TorqueIsThatOfTheEquationOfMotion) {
  const CoupledWheels wheels;
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const bool forward = mode == DriveMode::kPrescribedMotion;
    const SimulationRun run = Simulate(wheels.Make(), FourSeconds(), Turning, {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_TRUE(run.warnings.empty());
    EXPECT_LT(fixtures::TorqueError(run, Turning, wheels), forward ? 1e-8 : 1e-12);
    CoupledWheels perturbed = wheels;
    perturbed.curve *= 1.0 + 1e-6;
    EXPECT_GT(fixtures::TorqueError(run, Turning, perturbed), 2e-8);
    // The coupling's moment is not a reaction of the hinge.
    const int mz = run.trace.Find("two.reaction.mz");
    ASSERT_GE(mz, 0);
    EXPECT_LT(run.trace.values.col(mz).cwiseAbs().maxCoeff(), forward ? 1e-7 : 1e-12);
    EXPECT_LT(run.trace.values.col(run.trace.Find("closure.rotation")).cwiseAbs().maxCoeff(),
              forward ? 1e-9 : 1e-12);
  }
}

TEST(SimulatedCoupling, LossesAreThoseOfEitherDirectionOfPower) {
  const CoupledWheels wheels{.loss = 0.25, .loss_back = 0.4};
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const bool forward = mode == DriveMode::kPrescribedMotion;
    const SimulationRun run = Simulate(wheels.Make(), FourSeconds(), Turning, {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_LT(fixtures::TorqueError(run, Turning, wheels), forward ? 1e-8 : 1e-12);
    for (double CoupledWheels::*number : {&CoupledWheels::loss, &CoupledWheels::loss_back}) {
      CoupledWheels perturbed = wheels;
      perturbed.*number *= 1.0 + 1e-5;
      EXPECT_GT(fixtures::TorqueError(run, Turning, perturbed), 1e-7);
    }
  }
}

// Three linear terms are a fixed tendon: the third wheel is the sum of the others.
TEST(SimulatedCoupling, ASumIsAFixedTendon) {
  Mechanism m = CoupledWheels().Make();
  m.bodies.push_back(fixtures::MakeBody("third", 1.0, Vec3::Zero(), Vec3(0.02, 0.02, 0.03)));
  m.joints.push_back(
      fixtures::MakeJoint("three", JointKind::kRevolute, 0, Vec3(1, 0, 0), 3, Vec3::Zero(), 0.5));
  m.tree_joints.push_back(2);
  m.tree_reversed.push_back(false);
  m.X_WB_home.push_back(fixtures::PoseAt(Vec3(1, 0, 0), RotZ(0.5)));
  m.couplings[0] = {.name = "gear", .terms = {{1, 0, {-1.0}}, {0, 0, {-0.4}}}, .constant = 0.3};
  m.couplings.push_back({.name = "differential",
                         .terms = {{2, 0, {-2.0}}, {0, 0, {1.0}}, {1, 0, {3.0}}},
                         .constant = 2 * 0.5 - 3 * 0.3});
  EXPECT_EQ(mjcf::PlanCoupling(m, m.couplings[1]).type, mjcf::PlannedCoupling::Type::kTendon);
  const SimulationRun run = Simulate(m, FourSeconds(), Turning, {.mode = DriveMode::kInverse});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  // q3 = (q1 + 3 q2) / 2 + …, q̇3 = −0.1 q̇1: its inertia adds 0.01 · 0.03.
  const CoupledWheels two{.offset = 0.3, .ratio = -0.4, .curve = 0.0};
  const int column = run.trace.Find("motor.force");
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    DrivenSample at;
    (void)Turning(run.trace.time_s[i], &at);
    const double torque = two.Torque(at.position[0], at.velocity[0], at.acceleration[0]) +
                          0.01 * 0.03 * at.acceleration[0];
    EXPECT_NEAR(run.trace.values(static_cast<Eigen::Index>(i), column), torque, 1e-11);
  }
}

TEST(SimulatedCoupling, WhatMuJoCoDoesNotKnowIsReportedByName) {
  Mechanism m = CoupledWheels().Make();
  m.couplings[0].terms[0].polynomial = {-1.0, 0.1};
  const SimulationRun run = Simulate(m, FourSeconds(), Turning, {.mode = DriveMode::kInverse});
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported);
  EXPECT_EQ(run.summary.where, "cam");
  EXPECT_NE(run.summary.message.find("neither linear nor"), std::string::npos);
}

TEST(PlannedCoupling, IsThePolynomialAboutTheReference) {
  Mechanism m = CoupledWheels().Make();
  m.joints[0].home[0] = 0.7;
  m.joints[1].home[0] = 0.2;
  m.couplings[0].terms[1].polynomial = {0.5, -0.3, 0.2, 0.1};
  const mjcf::PlannedCoupling plan = mjcf::PlanCoupling(m, m.couplings[0]);
  ASSERT_EQ(plan.type, mjcf::PlannedCoupling::Type::kJoint);
  for (const double x : {-1.3, 0.0, 0.4, 2.0}) {
    const double q = 0.7 + x;
    const double wanted = 0.3 + 0.5 * q - 0.3 * q * q + 0.2 * q * q * q + 0.1 * q * q * q * q - 0.2;
    double is = 0.0;
    for (size_t i = 5; i-- > 0;) is = is * x + plan.polycoef[i];
    EXPECT_NEAR(is, wanted, 1e-14);
  }
}

TEST(PlannedCoupling, CountsItsErrorInTheJointThatMovesMore) {
  Mechanism m = CoupledWheels().Make();
  for (const double ratio : {0.01, 100.0}) {
    m.couplings[0].terms[1].polynomial = {ratio};
    const mjcf::PlannedCoupling plan = mjcf::PlanCoupling(m, m.couplings[0]);
    EXPECT_EQ(plan.first, ratio < 1.0 ? 1U : 0U);
    EXPECT_EQ(plan.second, 1U - plan.first);
    EXPECT_NEAR(plan.polycoef[1], 100.0, 1e-12);
  }
}

}  // namespace
}  // namespace mbv
