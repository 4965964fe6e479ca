// Free motion and shared drives of the simulation against formulas worked out by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mechanism/reach.h"
#include "reference/forward.h"
#include "simulation/engine/simulation.h"
#include "tests/mechanisms/simulated.h"

namespace mbv {
namespace {

// 1 ms steps of fourth order on motions of some rad/s.
constexpr double kIntegrated = 1e-8;

VecX Column(const SimulationRun& run, const std::string& name) {
  return run.trace.values.col(run.trace.Find(name));
}

SimulationRun RunFree(const Mechanism& m, const Motion& motion) {
  SimulationOptions options;
  if (RunSummary summary = InitialStates(m, motion, &options.start); !summary.ok()) {
    return {.trace = {},
            .summary = summary,
            .qpos = {},
            .X_WB = {},
            .mjcf = {},
            .warnings = {},
            .notes = {},
            .not_unique = {}};
  }
  return Simulate(m, motion, fixtures::HoldStill(std::vector<double>(m.drives.size(), 0.0)),
                  options);
}

TEST(FreeMotion, ADampedMassOnASpringFollowsItsClosedForm) {
  const double mass = 2.0, k = 50.0, c = 3.0, x0 = 0.1, v0 = 0.4;
  Mechanism m;
  m.name = "spring_mass";
  m.gravity_W.setZero();
  Body world;
  world.name = "world";
  m.bodies = {world, fixtures::MakeBody("mass", mass, {0, 0, 0}, {0.01, 0.01, 0.01})};
  m.joints = {fixtures::MakeJoint("slide", JointKind::kPrismatic, 0, {0, 0, 0}, 1, {0, 0, 0})};
  m.joints[0].axis = Vec3::UnitX();
  fixtures::AddTree(&m);
  m.X_WB_home.assign(2, Pose::Identity());
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
  m.springs = {{.name = "spring",
                .body_from = 0,
                .p_from = {-0.4, 0, 0},
                .body_to = 1,
                .stiffness = k,
                .damping = c,
                .free_length_m = 0.4}};
  const SimulationRun run = RunFree(m, fixtures::FreeMotion(m, x0, v0, 3.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double d = c / (2 * mass), w = std::sqrt(k / mass - d * d);
  const VecX x = Column(run, "motor.position");
  double worst = 0.0;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const double t = run.trace.time_s[i];
    const double exact =
        std::exp(-d * t) * (x0 * std::cos(w * t) + (v0 + d * x0) / w * std::sin(w * t));
    worst = std::max(worst, std::abs(x[i] - exact));
  }
  EXPECT_LT(worst, kIntegrated);
  // What is lost is the damper's work: E₀ − E, and by its closed form ½ m v₀² + ½ k x₀² at last.
  const VecX energy = Column(run, "energy.kinetic") + Column(run, "energy.springs");
  EXPECT_NEAR(energy[0], 0.5 * mass * v0 * v0 + 0.5 * k * x0 * x0, 1e-12);
  EXPECT_LT(
      ((energy.array() - energy[0]).matrix() - Column(run, "dampers.work")).cwiseAbs().maxCoeff(),
      kIntegrated);
}

TEST(FreeMotion, AFloatingBodyFliesAParabolaAndKeepsItsSpin) {
  const Mechanism m = fixtures::MakeFloater();
  Vec6 rates;
  rates << 0.3, -0.2, 4.0, 0.0, 0.0, 2.0;
  const SimulationRun run = RunFree(m, fixtures::FloatFree(rates, 0.5));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_NEAR(Column(run, "body.x").tail<1>()[0], 0.15, kIntegrated);
  EXPECT_NEAR(Column(run, "body.z").tail<1>()[0], 2.0 - 0.5 * 9.81 * 0.25, kIntegrated);
  EXPECT_NEAR(Column(run, "body.yaw").tail<1>()[0], 1.0, kIntegrated);
}

// A body hangs 0.3 m below a bead on a wire along x, or below a ball on a plate across x; reversed,
// wire and plate are its own and slide through a fixed point.
Mechanism MakeSlidingBody(JointKind kind, bool reversed) {
  Mechanism m = fixtures::MakeFloater();
  m.bodies[1].p_BoBcm_B = Vec3(0.05, 0.02, -0.3);
  Joint& joint = m.joints[0];
  joint.kind = kind;
  joint.axis = Vec3::UnitX();
  if (reversed) std::swap(joint.parent, joint.child);
  m.tree_reversed.assign(1, reversed);
  return m;
}

// Slides at 0.2 m/s, turned by 0.4, 0.7 and 0.2 rad.
Motion LetGo(const Mechanism& m) {
  Motion motion{.duration_s = 1.0, .sample_s = 0.01, .commands = {}, .loads = {}};
  const Joint& joint = m.joints[0];
  const int n = DofsOf(joint.kind);
  const double turns[] = {0.4, 0.7, 0.2};
  for (int c = 0; c < n; ++c) {
    const bool slides = IsLength(joint.kind, c);
    motion.initial.push_back({joint.name,
                              {Coordinate::Kind::kJoint, 0, c},
                              slides ? 0.1 : turns[c - (n - 3)],
                              slides ? 0.2 : 0.0});
  }
  return motion;
}

double DistanceFrom(const Trace& truth, const Trace& trace, const std::string& name) {
  return (truth.values.col(truth.Find(name)) - trace.values.col(trace.Find(name)))
      .cwiseAbs()
      .maxCoeff();
}

TEST(FreeMotion, ABodySlidesAlongAWireAndAPlateAsTheReferenceDoes) {
  for (const JointKind kind : {JointKind::kPointOnLine, JointKind::kPointOnPlane}) {
    for (const bool reversed : {false, true}) {
      const Mechanism m = MakeSlidingBody(kind, reversed);
      const Motion motion = LetGo(m);
      const std::string what = std::string(WordOf(kind)) + (reversed ? ", reversed" : "");
      const SimulationRun run = RunFree(m, motion);
      ASSERT_TRUE(run.summary.ok()) << what << ": " << run.summary.message;
      const ForwardRun reference = RunForwardReference(m, motion);
      ASSERT_TRUE(reference.summary.ok()) << what << ": " << reference.summary.message;
      for (const char* name : {"body.x", "body.y", "body.z", "body.roll", "body.yaw"}) {
        EXPECT_LT(DistanceFrom(reference.trace, run.trace, name), 10 * kIntegrated)
            << what << ", " << name;
      }
      const VecX energy = Column(run, "energy.kinetic") + Column(run, "energy.gravity");
      EXPECT_LT((energy.array() - energy[0]).abs().maxCoeff(), 10 * kIntegrated) << what;
    }
  }
}

// Nothing pushes the body along the wire: its centre of mass goes on as it was let go.
TEST(FreeMotion, AWireDoesNotPushAlongItself) {
  const Mechanism m = MakeSlidingBody(JointKind::kPointOnLine, false);
  const SimulationRun run = RunFree(m, LetGo(m));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto centre = [&](size_t i) { return (run.X_WB[i][1] * m.bodies[1].p_BoBcm_B).x(); };
  for (size_t i = 0; i < run.X_WB.size(); ++i) {
    EXPECT_NEAR(centre(i) - centre(0), 0.2 * run.trace.time_s[i], kIntegrated) << i;
  }
}

TEST(FreeMotion, AFloatingBodyHangsOnASpringAndIsPushedByALeg) {
  Mechanism m = fixtures::MakeFloater();
  m.gravity_W.setZero();
  const double k = 50.0, w = std::sqrt(k / 2.0), push = 0.5;
  m.springs = {{.name = "spring",
                .body_from = 0,
                .p_from = {-0.4, 0, 0},
                .body_to = 1,
                .stiffness = k,
                .free_length_m = 0.4}};
  m.drives.push_back(
      {.name = "leg", .kind = DistanceDrive{0, {-1, 0, 0}, 1, {0, 0, 0}}, .range = {}});
  Motion motion = fixtures::FloatFree(Vec6::Zero(), 1.0);
  motion.forces = {{0, Constant(push)}};
  const SimulationRun run = RunFree(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX x = Column(run, "body.x");
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    EXPECT_NEAR(x[i], push / k * (1 - std::cos(w * run.trace.time_s[i])), kIntegrated) << i;
  }
}

TEST(FreeMotion, APendulumReturnsAfterThePeriodOfTheEllipticIntegral) {
  const double length = 1.2, g = 9.81, amplitude = 2.5;
  Mechanism m;
  m.name = "pendulum";
  m.gravity_W = Vec3(0, 0, -g);
  Body world;
  world.name = "world";
  m.bodies = {world, fixtures::MakeBody("bob", 1.0, {0, 0, -length}, {1e-4, 1e-4, 1e-4})};
  m.joints = {fixtures::MakeJoint("pivot", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0})};
  m.joints[0].axis = Vec3::UnitY();
  fixtures::AddTree(&m);
  m.X_WB_home.assign(2, Pose::Identity());
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
  const double w = std::sqrt(g * length / (length * length + 1e-4));
  const double period = 4.0 / w * std::comp_ellint_1(std::sin(amplitude / 2));
  Motion motion = fixtures::FreeMotion(m, amplitude, 0.0, 3 * period);
  motion.sample_s = period / 100;
  const SimulationRun run = RunFree(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX angle = Column(run, "motor.position");
  EXPECT_NEAR(angle[300], amplitude, kIntegrated);
  EXPECT_NEAR(angle[50], -amplitude, kIntegrated);
  // A quarter of the period later it passes the lowest point, at the speed that gravity gives.
  EXPECT_NEAR(angle[25], 0.0, kIntegrated);
  EXPECT_NEAR(std::abs(Column(run, "motor.velocity")[25]), 2.0 * w * std::sin(amplitude / 2),
              10 * kIntegrated);
}

TEST(FreeMotion, AParallelogramTurnsEvenlyThroughItsFlatPoses) {
  const double start = 1.0, rate = 2.5;
  const Mechanism m = fixtures::MakeParallelogram(start);
  const SimulationRun run = RunFree(m, fixtures::FreeMotion(m, start, rate, 5.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX angle = Column(run, "motor.position");
  double worst = 0.0;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    worst = std::max(worst, std::abs(std::remainder(angle[i] - start - rate * run.trace.time_s[i],
                                                    2 * std::numbers::pi)));
  }
  EXPECT_LT(worst, kIntegrated);
}

TEST(SharedDrives, APairSharesATorqueByLeastNormInBothModes) {
  const Mechanism m = fixtures::MakeSharedArm();
  const double L = CharacteristicLength(m), torque = 3.0;
  const double f = 0.5 * torque / (L * L + 0.25);
  Motion motion;
  motion.duration_s = 0.01;
  motion.sample_s = 0.01;
  // At rest along x with the angular acceleration of the torque; the leg is 0.8 m long.
  const auto driven = [&](double t, DrivenSample* d) {
    const double a = 0.5 * (torque / 2.0) * t * t, rate = torque / 2.0 * t;
    const Vec3 foot(0.5, -0.8, 0), tip(0.5 * std::cos(a), 0.5 * std::sin(a), 0);
    const Vec3 leg = tip - foot, v = rate * Vec3(-tip.y(), tip.x(), 0);
    const Vec3 acceleration = torque / 2.0 * Vec3(-tip.y(), tip.x(), 0) - rate * rate * tip;
    const double length = leg.norm(), speed = leg.dot(v) / length;
    d->position = Eigen::Vector2d(a, length);
    d->velocity = Eigen::Vector2d(rate, speed);
    d->acceleration = Eigen::Vector2d(
        torque / 2.0, (leg.dot(acceleration) + v.squaredNorm() - speed * speed) / length);
    return RunSummary::Done();
  };
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const SimulationRun run = Simulate(m, motion, driven, {.mode = mode});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    // Forward, what softness leaves at the start; see the limits of the checks.
    const double tolerance = mode == DriveMode::kInverse ? 1e-12 : 1e-6;
    EXPECT_NEAR(Column(run, "leg.force")[0], f, tolerance);
    EXPECT_NEAR(Column(run, "motor.force")[0], torque - 0.5 * f, tolerance);
    EXPECT_EQ(run.not_unique.size(), 2u);
  }
}

}  // namespace
}  // namespace mbv
