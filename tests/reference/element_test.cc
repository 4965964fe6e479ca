// Force elements in the reference against an equation of motion by hand.
#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "reference/forward.h"
#include "tests/mechanisms/friction_pendulum.h"
#include "tests/mechanisms/pushed_block.h"
#include "tests/reference/fixture.h"
#include "tests/support/shipped.h"

namespace mbv::fixtures {
namespace {

// Through several turns, and back: 0.2 + 3 t + 7 sin 2t.
Motion Swinging(const Mechanism& m) {
  const Profile profile{
      {ConstantTerm{0.2}, RampTerm{.rate = 3.0}, SineTerm{7.0, 1 / std::numbers::pi, 0}}};
  return DriveMotion(m, {profile}, 4.0, 0.05);
}

TEST(ReferenceElements, TorqueIsThatOfTheEquationOfMotion) {
  const PendulumWithFriction pendulum;
  const Mechanism m = pendulum.Make();
  const ReferenceRun run = RunReference(m, Swinging(m));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_LT(TorqueError(run.trace, pendulum), 1e-12);
  // Every number counts.
  using P = PendulumWithFriction;
  for (double P::*number : {&P::damping, &P::free, &P::preload, &P::k1, &P::k2, &P::k3, &P::rotor,
                            &P::ratio, &P::coulomb, &P::breakaway, &P::stribeck}) {
    PendulumWithFriction perturbed = pendulum;
    perturbed.*number *= 1.0 + 1e-6;
    EXPECT_GT(TorqueError(run.trace, perturbed), 1e-10);
  }
}

TEST(ReferenceElements, AreNoReactionsAndBalanceThePower) {
  const Mechanism m = PendulumWithFriction().Make();
  const ReferenceRun run = RunReference(m, Swinging(m));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double power = ColumnOf(run.trace, "power.input").cwiseAbs().maxCoeff();
  EXPECT_LT((ColumnOf(run.trace, "power.input") - ColumnOf(run.trace, "power.energy_rate"))
                .cwiseAbs()
                .maxCoeff(),
            1e-12 * power);
  EXPECT_LT(ColumnOf(run.trace, "pivot.reaction.mz").cwiseAbs().maxCoeff(), 1e-12 * power);
}

TEST(ReferenceElements, EnergiesAreThoseByHand) {
  const PendulumWithFriction p;
  const Mechanism m = p.Make();
  const ReferenceRun run = RunReference(m, Swinging(m));
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double q = At(run.trace, i, "motor.position"), rate = At(run.trace, i, "motor.velocity");
    const double x = q - p.free;
    const double stored =
        p.preload * x + p.k1 * x * x / 2 + p.k2 * x * x * x / 3 + p.k3 * x * x * x * x / 4;
    const double J = p.I + p.m * p.r * p.r + p.rotor * p.ratio * p.ratio;
    EXPECT_NEAR(At(run.trace, i, "energy.springs"), stored, 1e-12 * std::abs(stored) + 1e-13);
    EXPECT_NEAR(At(run.trace, i, "energy.kinetic"), 0.5 * J * rate * rate, 1e-10);
    const double v = rate / p.stribeck;
    const double dry = p.coulomb + (p.breakaway - p.coulomb) * std::exp(-v * v);
    EXPECT_NEAR(At(run.trace, i, "power.dampers"), -p.damping * rate * rate - dry * std::abs(rate),
                1e-10);
  }
}

// J q̈ + m g r cos q + c q̇ + spring = 0, and the energy goes into the damper.
TEST(ReferenceElements, FreeMotionObeysTheEquationOfMotion) {
  PendulumWithFriction p;
  p.coulomb = p.breakaway = 0.0;
  const Mechanism m = p.Make();
  const ForwardRun run = RunForwardReference(m, FreeMotion(m, 0.3, 5.0, 2.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    EXPECT_NEAR(p.Torque(At(run.trace, i, "motor.position"), At(run.trace, i, "motor.velocity"),
                         At(run.trace, i, "motor.acceleration")),
                0.0, 1e-9);
  }
  const VecX energy = ColumnOf(run.trace, "energy.kinetic") +
                      ColumnOf(run.trace, "energy.gravity") + ColumnOf(run.trace, "energy.springs");
  const VecX lost = ColumnOf(run.trace, "dampers.work");
  EXPECT_LT(((energy.array() - energy[0]).matrix() - lost).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT(lost[lost.size() - 1], -0.1);
}

// Turns round exactly at t = 0.5 s: there the torque is known up to the breakaway torque.
TEST(ReferenceElements, DryFrictionAtRestLeavesABand) {
  PendulumWithFriction p;
  const Mechanism m = p.Make();
  const Profile profile{{SineTerm{1.0, 0.5, 0}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {profile}, 1.0, 0.05));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX band = ColumnOf(run.trace, "motor.force.band");
  for (Eigen::Index i = 0; i < band.size(); ++i) {
    EXPECT_NEAR(band[i], i == 10 ? 0.6 : 0.0, 1e-12) << i;
  }
  PendulumWithFriction smooth = p;
  smooth.coulomb = smooth.breakaway = 0.0;
  const double q = At(run.trace, 10, "motor.position");
  EXPECT_NEAR(At(run.trace, 10, "motor.force"),
              smooth.Torque(q, 0.0, At(run.trace, 10, "motor.acceleration")), 1e-12);
  EXPECT_NEAR(At(run.trace, 10, "power.dampers"), 0.0, 1e-15);
}

TEST(ReferenceElements, APrescribedJointThatRestsHasABand) {
  const Mechanism m = PendulumWithFriction().Prescribed();
  Motion hold{.duration_s = 1.0, .sample_s = 0.5, .commands = {}, .loads = {}};
  hold.commands = {Commanded("base", Coordinate::Kind::kPrescribed, 0, 0, {{ConstantTerm{0.3}}})};
  const ReferenceRun run = RunReference(m, hold);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_NEAR(At(run.trace, 1, "base.force.band"), 0.6, 1e-12);
}

// Swings out and comes to rest: at every sample friction is that of the load that the accelerations
// of this very sample make.
TEST(ReferenceElements, FrictionOfAFreeJournalIsByTheLoadOfItsAccelerations) {
  const JournalPendulum p{.coefficient = 0.6};
  const Mechanism m = p.Make();
  const ForwardRun run = RunForwardReference(m, FreeMotion(m, 0.3, 5.0, 8.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  JournalPendulum perturbed = p;
  perturbed.coefficient *= 1.0 + 1e-6;
  int slides = 0;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double q = At(run.trace, i, "motor.position"), rate = At(run.trace, i, "motor.velocity"),
                 acceleration = At(run.trace, i, "motor.acceleration");
    if (std::abs(rate) < 1e-6) continue;
    ++slides;
    EXPECT_NEAR(p.FreeTorque(q, rate, acceleration), 0.0, 1e-12) << i;
    EXPECT_GT(std::abs(perturbed.FreeTorque(q, rate, acceleration)), 1e-9) << i;
  }
  EXPECT_GT(slides, 10);
  const Eigen::Index end = run.trace.values.rows() - 1;
  EXPECT_EQ(At(run.trace, end, "motor.velocity"), 0.0);
  const double q = At(run.trace, end, "motor.position");
  EXPECT_LT(std::abs(p.g * std::cos(q)), p.coefficient * p.radius / p.r * p.g);
  const double start = At(run.trace, 0, "energy.kinetic") + At(run.trace, 0, "energy.gravity");
  EXPECT_NEAR(At(run.trace, end, "energy.gravity") - start, At(run.trace, end, "dampers.work"),
              1e-10);
}

// Pushed from below by a growing force, the block breaks away where the push has taken so much of
// its weight that the rest of it holds no longer.
TEST(ReferenceElements, FrictionByLoadBreaksAwayByTheLoad) {
  const PushedBlock block;
  const Mechanism m = block.Make();
  Motion motion = FreeMotion(m, 0.4, 0.0, 1.0);
  const double r = 6.0,
               start = block.coefficient * block.m * block.g / (0.8 + block.coefficient * 0.6) / r;
  motion.sample_s = 0.01;
  motion.forces[0].force = {{RampTerm{.rate = r}}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  ASSERT_EQ(run.trace.events.size(), 1U);
  EXPECT_NEAR(run.trace.events[0].time_s, start, 1e-11);
  EXPECT_EQ(run.trace.events[0].what, Happening::kSlidesUp);
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double t = run.trace.time_s[static_cast<size_t>(i)];
    const double L = At(run.trace, i, "leg.position"), rate = At(run.trace, i, "leg.velocity");
    if (t < start) {
      EXPECT_NEAR(L, 0.5, 1e-14);
      continue;
    }
    EXPECT_NEAR(block.Force(L, rate, At(run.trace, i, "leg.acceleration")), r * t, 1e-10) << i;
  }
  const ForwardRun perturbed =
      RunForwardReference(PushedBlock{.coefficient = 0.2501}.Make(), motion);
  EXPECT_GT(std::abs(perturbed.trace.events.at(0).time_s - start), 1e-5);
}

// A journal as large as that takes back more load than it makes: no acceleration, or several.
TEST(ReferenceElements, FreeFrictionByLoadWithoutASolutionIsRefused) {
  JournalPendulum p;
  p.coefficient = 8.0;
  const ForwardRun run = RunForwardReference(p.Make(), FreeMotion(p.Make(), 0.3, 5.0, 1.0));
  EXPECT_EQ(run.summary.stop, Stop::kSingular) << run.summary.message;
  EXPECT_EQ(run.summary.where, "journal");
  EXPECT_EQ(run.summary.time_s, 0.0);
  const double J = PendulumWithFriction::I + p.m * p.r * p.r;
  EXPECT_NEAR(run.summary.amount, p.coefficient * p.radius * p.m * p.r / J, 1e-12);
  const Mechanism shared = JournalPendulum().OnTwoHinges();
  const ForwardRun two = RunForwardReference(shared, FreeMotion(shared, 0.3, 5.0, 1.0));
  EXPECT_EQ(two.summary.stop, Stop::kUnsupported) << two.summary.message;
  EXPECT_EQ(two.summary.where, "journal");
}

// A spring's preload in an element's place moves the torques by as much as it opens them.
TEST(ReferenceElements, ABandIsWhatAForceInTheElementsPlaceWouldMove) {
  const LoadResult loaded = LoadModel(SourcePath("/models/friction_five_bar/model.yaml"));
  ASSERT_TRUE(loaded.mechanism);
  const Mechanism& m = *loaded.mechanism;
  Profile home1{{ConstantTerm{m.joints[0].home[0]}}}, home2{{ConstantTerm{m.joints[1].home[0]}}};
  const Motion hold = DriveMotion(m, {home1, home2}, 1.0, 0.5);
  const ReferenceRun run = RunReference(m, hold);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (const char* motor : {"motor1", "motor2"}) {
    const std::string force = std::string(motor) + ".force";
    double band = 0.0;
    for (size_t e = 0; e < m.elements.size(); ++e) {
      if (!HasFriction(m.elements[e])) continue;
      Mechanism pressed = m;
      const double most = std::get<FrictionLaw>(m.elements[e].law).breakaway;
      pressed.elements[e].law = SpringLaw{.polynomial = {0.0}, .preload = most};
      const double moved = At(RunReference(pressed, hold).trace, 0, force);
      band += std::abs(moved - At(run.trace, 0, force));
    }
    EXPECT_NEAR(At(run.trace, 0, force + ".band"), band, 1e-12);
    EXPECT_GT(band, 0.25);  // of its own bearing alone 0.32 or 0.24
  }
}

// At sample 10, of the load that the middle has: m g − F sin θ.
double BandAt(const PushedBlock& block, const Trace& trace) {
  const double L = At(trace, 10, "leg.position"), x = std::sqrt(L * L - block.h * block.h);
  const double load = block.m * block.g - At(trace, 10, "leg.force") * block.h / L;
  return block.coefficient * load * L / x;
}

// Turns round at t = 0.5 s, where the block rests.
TEST(ReferenceElements, FrictionByLoadIsThatOfAPushedBlock) {
  const PushedBlock block;
  const Mechanism m = block.Make();
  const Profile profile{{ConstantTerm{0.55}, SineTerm{0.05, 0.5, 0}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {profile}, 1.0, 0.05));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  PushedBlock perturbed = block;
  perturbed.coefficient *= 1.0 + 1e-6;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double L = At(run.trace, i, "leg.position");
    const double rate = i == 10 ? 0.0 : At(run.trace, i, "leg.velocity");
    const double acceleration = At(run.trace, i, "leg.acceleration");
    const double force = At(run.trace, i, "leg.force");
    EXPECT_NEAR(force, block.Force(L, rate, acceleration), 1e-11) << i;
    const double away = std::abs(force - perturbed.Force(L, rate, acceleration));
    EXPECT_GT(away, i == 10 ? -1.0 : 1e-8) << i;
    EXPECT_NEAR(At(run.trace, i, "leg.force.band"), i == 10 ? BandAt(block, run.trace) : 0.0,
                1e-11);
    EXPECT_NEAR(At(run.trace, i, "power.input"), At(run.trace, i, "power.energy_rate"), 1e-11);
  }
}

TEST(ReferenceElements, FrictionOfAJournalIsByItsRadialLoadOnly) {
  const JournalPendulum p;
  const Mechanism m = p.Make();
  const Profile even{{ConstantTerm{0.2}, RampTerm{.rate = -3.0}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {even}, 2.0, 0.1));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double q = At(run.trace, i, "motor.position");
    EXPECT_NEAR(At(run.trace, i, "motor.force"), p.Torque(q, -3.0), 1e-13);
  }
}

TEST(ReferenceElements, FrictionByASharedLoadIsRefused) {
  const Mechanism m = JournalPendulum().OnTwoHinges();
  const Profile even{{ConstantTerm{0.2}, RampTerm{.rate = -3.0}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {even}, 1.0, 0.5));
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported) << run.summary.message;
  EXPECT_EQ(run.summary.where, "journal");
}

// Where the block is pressed against the guide as fast as it is pushed, no force is determined.
TEST(ReferenceElements, FrictionByLoadThatFeedsItselfIsRefused) {
  const Mechanism m = PushedBlock{.coefficient = 2.0}.Make();
  const Profile profile{{ConstantTerm{0.55}, RampTerm{.rate = 0.05}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {profile}, 1.0, 0.5));
  EXPECT_EQ(run.summary.stop, Stop::kSingular);
  EXPECT_EQ(run.summary.time_s, 0.0);
  EXPECT_NEAR(run.summary.amount, 2.0 * 0.3 / std::sqrt(0.55 * 0.55 - 0.09), 1e-12);
}

// Along a leg's length: a mass of 2 kg on a rail, hung on a distance drive.
TEST(ReferenceElements, ActAlongADistanceDrive) {
  Mechanism m;
  m.name = "cart";
  m.gravity_W.setZero();
  m.bodies = {MakeBody("world", 0.0, Vec3::Zero(), Vec3::Zero()),
              MakeBody("cart", 2.0, Vec3::Zero(), Vec3::Constant(0.01))};
  m.joints = {MakeJoint("rail", JointKind::kPrismatic, 0, Vec3::Zero(), 1, Vec3::Zero())};
  m.joints[0].axis = Vec3::UnitX();
  AddTree(&m);
  m.X_WB_home.assign(2, Pose::Identity());
  m.drives = {{.name = "leg", .kind = DistanceDrive{0, {-0.5, 0, 0}, 1, {0, 0, 0}}, .range = {}}};
  m.elements = {{.name = "c", .drive = 0, .law = DampingLaw{3.0}},
                {.name = "k", .drive = 0, .law = SpringLaw{{40.0}, 0.3, -2.0}},
                {.name = "J", .drive = 0, .law = RotorLaw{1e-4, 200.0}}};
  const Profile profile{{ConstantTerm{0.5}, SineTerm{0.1, 1.0, 0.3}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {profile}, 1.0, 0.05));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double force = (2.0 + 4.0) * At(run.trace, i, "leg.acceleration") +
                         3.0 * At(run.trace, i, "leg.velocity") +
                         40.0 * (At(run.trace, i, "leg.position") - 0.3) - 2.0;
    EXPECT_NEAR(At(run.trace, i, "leg.force"), force, 1e-12);
  }
}

}  // namespace
}  // namespace mbv::fixtures
