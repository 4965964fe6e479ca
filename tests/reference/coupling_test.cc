// Coupled joints in the reference against an equation of motion by hand.
#include <gtest/gtest.h>

#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "reference/forward.h"
#include "tests/mechanisms/coupled_wheels.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

// Through several turns: 1 + 9 t + 3 sin 2t.
Motion Turning(const Mechanism& m) {
  Profile profile{
      {ConstantTerm{1.0}, RampTerm{.rate = 9.0}, SineTerm{3.0, 1 / std::numbers::pi, 0}}};
  return DriveMotion(m, {profile}, 4.0, 0.05);
}

TEST(ReferenceCoupling, TorqueIsThatOfTheEquationOfMotion) {
  const CoupledWheels wheels;
  const Mechanism m = wheels.Make();
  const ReferenceRun run = RunReference(m, Turning(m));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_GT(At(run.trace, run.trace.values.rows() - 1, "motor.position"), 5 * 2 * std::numbers::pi);
  EXPECT_LT(TorqueError(run.trace, wheels), 1e-12);
  // What is not coupled by the numbers of the file is seen.
  CoupledWheels perturbed = wheels;
  perturbed.curve *= 1.0 + 1e-9;
  EXPECT_GT(TorqueError(run.trace, perturbed), 1e-11);
}

TEST(ReferenceCoupling, LossesAreThoseOfEitherDirectionOfPower) {
  const CoupledWheels wheels{.loss = 0.25, .loss_back = 0.4};
  const Mechanism m = wheels.Make();
  const ReferenceRun run = RunReference(m, Turning(m));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_LT(TorqueError(run.trace, wheels), 1e-12);
  const VecX power = ColumnOf(run.trace, "power.input"),
             rate = ColumnOf(run.trace, "power.energy_rate");
  EXPECT_LT((power - rate).cwiseAbs().maxCoeff(), 1e-12 * power.cwiseAbs().maxCoeff());
  for (double CoupledWheels::*number : {&CoupledWheels::loss, &CoupledWheels::loss_back}) {
    CoupledWheels perturbed = wheels;
    perturbed.*number *= 1.0 + 1e-6;
    EXPECT_GT(TorqueError(run.trace, perturbed), 1e-8);
  }
}

// The second wheel's weight turns both, or not: the first is driven back and locks where nothing of
// the power comes out there.
TEST(ReferenceCoupling, WhatIsDrivenBackMovesOrLocks) {
  for (const double back : {0.4, 1.0}) {
    const CoupledWheels wheels{.curve = 0.0, .loss = 0.25, .loss_back = back};
    const Mechanism m = wheels.Make();
    const ForwardRun run = RunForwardReference(m, FreeMotion(m, 0.0, 0.0, 1.0));
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    CoupledWheels perturbed = wheels;
    perturbed.loss_back *= 1.0 + 1e-6;
    double error = 0.0, seen = 0.0, farthest = 0.0;
    for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
      const double q = At(run.trace, i, "motor.position"), v = At(run.trace, i, "motor.velocity"),
                   a = At(run.trace, i, "motor.acceleration");
      farthest = std::max(farthest, std::abs(q));
      if (v == 0.0) continue;
      error = std::max(error, std::abs(wheels.Torque(q, v, a)));
      seen = std::max(seen, std::abs(perturbed.Torque(q, v, a)));
    }
    if (back == 1.0) {
      EXPECT_EQ(farthest, 0.0);
      continue;
    }
    EXPECT_GT(farthest, 1.0);
    EXPECT_LT(error, 1e-11);
    EXPECT_GT(seen, 1e-8);
  }
}

TEST(ReferenceCoupling, CountsInMobility) {
  Mechanism m = CoupledWheels().Make();
  const Mobility coupled = AnalyseMobility(m);
  EXPECT_EQ(coupled.dofs, 1);
  EXPECT_EQ(coupled.undriven, 0);
  m.couplings.push_back(m.couplings[0]);
  const Mobility twice = AnalyseMobility(m);
  EXPECT_EQ(twice.dofs, 1);
  EXPECT_EQ(twice.redundant, 1);
  m.couplings.clear();
  EXPECT_EQ(AnalyseMobility(m).dofs, 2);
}

TEST(ReferenceCoupling, HomeMeetsIt) {
  Mechanism m = CoupledWheels().Make();
  m.joints[0].guess[0] = 0.7;
  m.joints[1].guess[0] = 0.0;
  const HomeResult home = SolveHome(&m);
  EXPECT_TRUE(home.closed);
  EXPECT_NEAR(m.joints[0].home[0], 0.7, 1e-15);  // driven: stays
  EXPECT_NEAR(m.joints[1].home[0], 0.3 - 0.4 * 0.7 + 0.015 * 0.49, 1e-12);
}

TEST(ReferenceCoupling, ContradictionIsReportedWithItsAmount) {
  Mechanism m = CoupledWheels().Make();
  Coupling other = m.couplings[0];
  other.name = "belt";
  other.terms[1].polynomial = {0.0, 0.0, 0.0, 1e-30};
  other.constant = 0.8;  // cam and belt would need q2 at two places for every q1 near 0
  m.couplings[0].terms[1].polynomial = {1e-30};
  m.couplings.push_back(other);
  const HomeResult home = SolveHome(&m);
  EXPECT_FALSE(home.closed);
  ASSERT_EQ(home.couplings.size(), 2u);
  EXPECT_NEAR(std::abs(home.couplings[0].amount), 0.25, 1e-6);
  EXPECT_NE(home.Text(m).find("coupling cam of two, one is missed by"), std::string::npos)
      << home.Text(m);
}

TEST(ReferenceCoupling, FreeMotionKeepsItAndItsEnergy) {
  const CoupledWheels wheels;
  const Mechanism m = wheels.Make();
  Motion motion;
  motion.duration_s = 2.0;
  motion.sample_s = 0.02;
  motion.initial = {{.name = "motor",
                     .coordinate = {.kind = Coordinate::Kind::kDrive, .index = 0},
                     .position = 0.0,
                     .rate = 6.0}};
  motion.forces = {{.drive = 0, .force = Constant(0.0)}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_LT(ColumnOf(run.trace, "closure.rotation").cwiseAbs().maxCoeff(), 1e-12);
  const VecX energy = ColumnOf(run.trace, "energy.kinetic") + ColumnOf(run.trace, "energy.gravity");
  EXPECT_LT((energy.array() - energy[0]).abs().maxCoeff(), 1e-9);
  // J1 q̈1 + P′ (J2 (P′ q̈1 + P″ q̇1²) + m g r cos q2) = 0.
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    EXPECT_NEAR(
        wheels.Torque(At(run.trace, i, "motor.position"), At(run.trace, i, "motor.velocity"),
                      At(run.trace, i, "motor.acceleration")),
        0.0, 1e-9);
  }
}

}  // namespace
}  // namespace mbv::fixtures
