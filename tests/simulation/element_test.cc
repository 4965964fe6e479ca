// Force elements in MuJoCo against an equation of motion by hand.
#include <gtest/gtest.h>

#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"
#include "simulation/mjcf/plan.h"
#include "tests/mechanisms/friction_pendulum.h"
#include "tests/mechanisms/pushed_block.h"
#include "tests/reference/fixture.h"
#include "tests/simulation/torque_error.h"

namespace mbv {
namespace {

using fixtures::PendulumWithFriction;

// Through several turns: 0.2 + 3 t + 7 sin 2t.
RunSummary SwingAt(double t, DrivenSample* driven) {
  driven->position = VecX::Constant(1, 0.2 + 3 * t + 7 * std::sin(2 * t));
  driven->velocity = VecX::Constant(1, 3 + 14 * std::cos(2 * t));
  driven->acceleration = VecX::Constant(1, -28 * std::sin(2 * t));
  return RunSummary::Done();
}

Motion Swing() { return {.duration_s = 4.0, .sample_s = 0.02, .commands = {}, .loads = {}}; }

void ExpectBalanced(const SimulationRun& run, double tolerance) {
  const VecX in = run.trace.values.col(run.trace.Find("power.input"));
  const VecX rate = run.trace.values.col(run.trace.Find("power.energy_rate"));
  const double size = in.cwiseAbs().maxCoeff();
  EXPECT_LT((in - rate).cwiseAbs().maxCoeff(), tolerance * size);
  const VecX mz = run.trace.values.col(run.trace.Find("pivot.reaction.mz"));
  EXPECT_LT(mz.cwiseAbs().maxCoeff(), tolerance * size);
}

TEST(SimulatedElements, TorqueIsThatOfTheEquationOfMotion) {
  for (const bool linear : {true, false}) {
    PendulumWithFriction pendulum;
    pendulum.linear = linear;
    const Mechanism m = pendulum.Make();
    for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
      const bool forward = mode == DriveMode::kPrescribedMotion;
      const SimulationRun run = Simulate(m, Swing(), SwingAt, {.mode = mode});
      ASSERT_TRUE(run.summary.ok()) << run.summary.message;
      EXPECT_TRUE(run.warnings.empty());
      EXPECT_LT(fixtures::TorqueError(run, SwingAt, pendulum), forward ? 1e-7 : 1e-12) << linear;
      ExpectBalanced(run, forward ? 1e-6 : 1e-12);
      PendulumWithFriction perturbed = pendulum;
      perturbed.preload *= 1.0 + 1e-3;
      EXPECT_GT(fixtures::TorqueError(run, SwingAt, perturbed), 1e-6);
    }
  }
}

TEST(SimulatedElements, DryFrictionAtRestLeavesABand) {
  PendulumWithFriction p;
  const Mechanism m = p.Make();
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const SimulationRun run = Simulate(m, Swing(), fixtures::HoldStill({0.3}), {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const VecX band = run.trace.values.col(run.trace.Find("motor.force.band"));
    EXPECT_LT((band.array() - p.breakaway).abs().maxCoeff(), 1e-12);
    const VecX middle = run.trace.values.col(run.trace.Find("motor.force"));
    PendulumWithFriction smooth = p;
    smooth.coulomb = smooth.breakaway = 0.0;
    EXPECT_LT((middle.array() - smooth.Torque(0.3, 0.0, 0.0)).abs().maxCoeff(), 1e-6);
    EXPECT_LT(run.trace.values.col(run.trace.Find("power.dampers")).cwiseAbs().maxCoeff(), 1e-12);
    const SimulationRun moving = Simulate(m, Swing(), SwingAt, {.mode = mode});
    EXPECT_EQ(moving.trace.values.col(moving.trace.Find("motor.force.band")).maxCoeff(), 0.0);
  }
}

TEST(SimulatedElements, APrescribedJointThatRestsHasABand) {
  const Mechanism m = PendulumWithFriction().Prescribed();
  const SimulationRun run =
      Simulate(m, Swing(), fixtures::HoldStill({0.3}), {.mode = DriveMode::kInverse});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_NEAR(run.trace.values(1, run.trace.Find("base.force.band")), 0.6, 1e-12);
}

RunSummary SpinAt(double t, DrivenSample* driven) {
  driven->position = VecX::Constant(1, 0.2 - 3 * t);
  driven->velocity = VecX::Constant(1, -3.0);
  driven->acceleration = VecX::Zero(1);
  return RunSummary::Done();
}

TEST(SimulatedElements, FrictionByASharedLoadIsRefused) {
  const Mechanism m = fixtures::JournalPendulum().OnTwoHinges();
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const SimulationRun run = Simulate(m, Swing(), SpinAt, {.mode = mode});
    EXPECT_EQ(run.summary.stop, Stop::kUnsupported) << run.summary.message;
    EXPECT_EQ(run.summary.where, "journal");
    EXPECT_EQ(run.summary.time_s, 0.0);
  }
}

TEST(SimulatedElements, FrictionOfAJournalIsByItsRadialLoadOnly) {
  const fixtures::JournalPendulum p;
  const Mechanism m = p.Make();
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const SimulationRun run = Simulate(m, Swing(), SpinAt, {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const double limit = mode == DriveMode::kPrescribedMotion ? 1e-7 : 1e-13;
    for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      EXPECT_NEAR(run.trace.values(row, run.trace.Find("motor.force")),
                  p.Torque(0.2 - 3 * run.trace.time_s[i], -3.0), limit);
    }
  }
}

RunSummary PushAt(double t, DrivenSample* driven) {
  driven->position = VecX::Constant(1, 0.6 + 0.1 * t + 0.02 * std::sin(2 * t));
  driven->velocity = VecX::Constant(1, 0.1 + 0.04 * std::cos(2 * t));
  driven->acceleration = VecX::Constant(1, -0.08 * std::sin(2 * t));
  return RunSummary::Done();
}

TEST(SimulatedElements, FrictionByLoadIsThatOfAPushedBlock) {
  const fixtures::PushedBlock block;
  const Mechanism m = block.Make();
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const bool forward = mode == DriveMode::kPrescribedMotion;
    const SimulationRun run = Simulate(m, Swing(), PushAt, {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    double worst = 0.0, perturbed = 0.0;
    for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
      DrivenSample at;
      (void)PushAt(run.trace.time_s[i], &at);
      const auto row = static_cast<Eigen::Index>(i);
      const double force = run.trace.values(row, run.trace.Find("leg.force"));
      const auto off = [&](const fixtures::PushedBlock& by) {
        return std::abs(force - by.Force(at.position[0], at.velocity[0], at.acceleration[0]));
      };
      worst = std::max(worst, off(block));
      perturbed = std::max(perturbed, off({.coefficient = 1.001 * block.coefficient}));
    }
    EXPECT_LT(worst, forward ? 1e-5 : 1e-11);
    EXPECT_GT(perturbed, 1e-3);
    const VecX in = run.trace.values.col(run.trace.Find("power.input"));
    const VecX rate = run.trace.values.col(run.trace.Find("power.energy_rate"));
    EXPECT_LT((in - rate).cwiseAbs().maxCoeff(), 1e-6 * in.cwiseAbs().maxCoeff());
  }
}

// MuJoCo has these on joints; the file states them, a preload as a moved free position.
TEST(SimulatedElements, TheFileCarriesWhatMuJoCoHasAndNamesWhatItLacks) {
  PendulumWithFriction pendulum;
  const std::string all = WriteMjcf(pendulum.Make());
  EXPECT_NE(all.find("damping=\"0.07\""), std::string::npos) << all;
  EXPECT_NE(all.find("armature=\"0.03675"), std::string::npos) << all;
  EXPECT_EQ(all.find("stiffness="), std::string::npos) << all;
  EXPECT_NE(all.find("spring: spring of joint 'pivot'"), std::string::npos) << all;
  EXPECT_NE(all.find("dry: friction of joint 'pivot'"), std::string::npos) << all;
  pendulum.linear = true;
  const Mechanism m = pendulum.Make();
  const std::string linear = WriteMjcf(m);
  EXPECT_NE(linear.find("stiffness=\"2.5\""), std::string::npos) << linear;
  EXPECT_EQ(linear.find("Not in this file"), std::string::npos) << linear;
  const mjcf::PlannedForces forces = mjcf::ForcesOfJoint(m, 0, 0);
  EXPECT_NEAR(forces.free, 0.4 - 0.9 / 2.5, 1e-15);
  // Two springs act as one at their common rest.
  Mechanism two = m;
  two.elements.push_back({.name = "more", .joint = 0, .law = SpringLaw{{7.5}, -0.2, 0.3}});
  const mjcf::PlannedForces both = mjcf::ForcesOfJoint(two, 0, 0);
  EXPECT_NEAR(both.stiffness, 10.0, 1e-15);
  for (const double q : {-1.0, 0.5}) {
    EXPECT_NEAR(both.stiffness * (q - both.free), 0.9 + 2.5 * (q - 0.4) + 0.3 + 7.5 * (q + 0.2),
                1e-13);
  }
}

// A cart of 2 kg on a rail, held by a leg along it with everything that a tendon can have.
Mechanism CartOnALeg() {
  Mechanism m;
  m.name = "cart";
  m.gravity_W.setZero();
  m.bodies = {fixtures::MakeBody("world", 0.0, Vec3::Zero(), Vec3::Zero()),
              fixtures::MakeBody("cart", 2.0, Vec3::Zero(), Vec3::Constant(0.01))};
  m.joints = {fixtures::MakeJoint("rail", JointKind::kPrismatic, 0, Vec3::Zero(), 1, Vec3::Zero())};
  m.joints[0].axis = Vec3::UnitX();
  fixtures::AddTree(&m);
  m.X_WB_home.assign(2, Pose::Identity());
  m.drives = {{.name = "leg", .kind = DistanceDrive{0, {-0.5, 0, 0}, 1, {0, 0, 0}}, .range = {}}};
  m.elements = {{.name = "c", .drive = 0, .law = DampingLaw{3.0}},
                {.name = "k", .drive = 0, .law = SpringLaw{{40.0}, 0.3, -2.0}},
                {.name = "hard", .drive = 0, .law = SpringLaw{{0.0, 5.0}, 0.1, 0.7}},
                {.name = "J", .drive = 0, .law = RotorLaw{1e-4, 200.0}}};
  return m;
}

RunSummary ShakenLeg(double t, DrivenSample* driven) {
  driven->position = VecX::Constant(1, 0.5 + 0.1 * std::sin(5 * t + 0.3));
  driven->velocity = VecX::Constant(1, 0.5 * std::cos(5 * t + 0.3));
  driven->acceleration = VecX::Constant(1, -2.5 * std::sin(5 * t + 0.3));
  return RunSummary::Done();
}

TEST(SimulatedElements, ActAlongADistanceDrive) {
  const Mechanism m = CartOnALeg();
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const SimulationRun run = Simulate(m, Swing(), ShakenLeg, {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const int column = run.trace.Find("leg.force");
    for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
      DrivenSample at;
      (void)ShakenLeg(run.trace.time_s[i], &at);
      const double x = at.position[0], y = x - 0.1;
      const double force = 6.0 * at.acceleration[0] + 3.0 * at.velocity[0] + 40.0 * (x - 0.3) -
                           2.0 + 0.7 + 5.0 * y * y;
      EXPECT_NEAR(run.trace.values(static_cast<Eigen::Index>(i), column), force,
                  mode == DriveMode::kPrescribedMotion ? 1e-6 : 1e-11);
    }
    const VecX in = run.trace.values.col(run.trace.Find("power.input"));
    const VecX rate = run.trace.values.col(run.trace.Find("power.energy_rate"));
    EXPECT_LT((in - rate).cwiseAbs().maxCoeff(), 1e-6 * in.cwiseAbs().maxCoeff());
    const VecX fx = run.trace.values.col(run.trace.Find("rail.reaction.fx"));
    EXPECT_LT(fx.cwiseAbs().maxCoeff(), 1e-6);
  }
}

// Its mass along the leg would be felt before the acceleration is known.
TEST(SimulatedElements, ARotorOnAFreeDistanceDriveIsRefused) {
  const Mechanism m = CartOnALeg();
  const SimulationRun run = Simulate(m, fixtures::FreeMotion(m, 0.0, 0.0, 1.0), ShakenLeg, {});
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported);
  EXPECT_EQ(run.summary.where, "J");
  EXPECT_NE(run.summary.message.find("no inertia along a tendon"), std::string::npos)
      << run.summary.message;
}

// An arm that grips a parcel at its tip and lets it go again:
//   τ = (J + s J_p) q̈ + g cos q (m r + s m_p r_p), s the parcel's share
struct Gripper {
  static constexpr double kMass = 0.5, kArm = 0.45, kInertia = 0.003;
  double mass = kMass;

  [[nodiscard]] Mechanism Make() const {
    Mechanism m = fixtures::MakePivotedBar();
    m.bodies.push_back(
        fixtures::MakeBody("parcel", mass, Vec3(0.05, 0, 0), Vec3(0.001, 0.002, kInertia)));
    m.joints.push_back(
        fixtures::MakeJoint("grip", JointKind::kFixed, 1, Vec3(0.4, 0, 0), 2, Vec3::Zero()));
    m.tree_joints.push_back(1);
    m.tree_reversed.push_back(false);
    m.X_WB_home = TreePoses(m, {m.joints[0].guess, m.joints[1].guess});
    return m;
  }
  [[nodiscard]] double Torque(double t, double q, double a) const {
    const double s = t >= 0.5 && t < 1.25 ? 1.0 : 0.0;
    return (0.072 + s * (kInertia + mass * kArm * kArm)) * a +
           9.81 * std::cos(q) * (1.3 * 0.2 + s * mass * kArm);
  }
  [[nodiscard]] double Error(const Trace& trace) const {
    double error = 0.0;
    for (Eigen::Index i = 0; i < trace.values.rows(); ++i) {
      const double t = trace.time_s[static_cast<size_t>(i)];
      const double truth = Torque(t, fixtures::At(trace, i, "motor.position"),
                                  fixtures::At(trace, i, "motor.acceleration"));
      error = std::max(error, std::abs(fixtures::At(trace, i, "motor.force") - truth));
    }
    return error;
  }
};

TEST(Payloads, AreCarriedWhileTheyAreStated) {
  const Gripper gripper;
  const Mechanism m = gripper.Make();
  Motion motion = fixtures::DriveMotion(m, {{{SineTerm{0.8, 0.5, 0}}}}, 2.0, 0.02);
  motion.switches = {
      {.name = "parcel",
       .body = 2,
       .share = {{JumpTerm{.at_s = 0.5, .delta = 1.0}, JumpTerm{.at_s = 1.25, .delta = -1.0}}}}};
  const Profile profile = motion.commands[0].profile;
  const auto driven = [&](double t, DrivenSample* at) {
    const Jet jet = Evaluate(profile, t);
    at->position = VecX::Constant(1, jet.value);
    at->velocity = VecX::Constant(1, jet.rate);
    at->acceleration = VecX::Constant(1, jet.acceleration);
    return RunSummary::Done();
  };
  const ReferenceRun reference = RunReference(m, motion);
  ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
  EXPECT_LT(gripper.Error(reference.trace), 1e-12);
  EXPECT_GT(Gripper{.mass = Gripper::kMass * (1.0 + 1e-6)}.Error(reference.trace), 1e-7);
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const bool forward = mode == DriveMode::kPrescribedMotion;
    const SimulationRun run = Simulate(m, motion, driven, {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_LT(gripper.Error(run.trace), forward ? 1e-7 : 1e-12);
    EXPECT_GT(Gripper{.mass = Gripper::kMass * (1.0 + 1e-5)}.Error(run.trace), 1e-6);
    for (const char* channel : {"energy.kinetic", "energy.gravity", "grip.reaction.fy"}) {
      const VecX off =
          fixtures::ColumnOf(run.trace, channel) - fixtures::ColumnOf(reference.trace, channel);
      EXPECT_LT(off.cwiseAbs().maxCoeff(), forward ? 1e-7 : 1e-12) << channel;
    }
  }
}

}  // namespace
}  // namespace mbv
