// Loads that follow the mechanism's state against force elements, which are computed otherwise.
#include <gtest/gtest.h>

#include "reference/forward.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

// −k (q − 0.4) − c q̇ + a t about z.
Load Follower(double k, double c, double a) {
  const Coordinate q{Coordinate::Kind::kJoint, 0, 0};
  Load load{.name = "follower", .body = 1, .force = {}, .moment = {}};
  load.following.push_back({5,
                            {.inputs = {{q, false, 0.3}, {q, true, 0.3}},
                             .value = [=](double t_s, std::span<const double> x) {
                               return -k * (x[0] - 0.4) - c * x[1] + a * t_s;
                             }}});
  return load;
}

Motion Swing(const Mechanism& m) {
  return DriveMotion(m, {{{ConstantTerm{0.3}, SineTerm{1.2, 0.8, 0.4}}}}, 2.0, 0.05);
}

TEST(StateLoads, AreTheSpringAndTheDamperThatTheyDescribe) {
  const Mechanism plain = MakePivotedBar();
  Mechanism sprung = plain;
  sprung.elements = {{.name = "k", .joint = 0, .law = SpringLaw{{3.0}, 0.4}},
                     {.name = "c", .joint = 0, .law = DampingLaw{0.2}}};
  Motion loaded = Swing(plain);
  loaded.loads = {Follower(3.0, 0.2, 0.7)};
  const ReferenceRun load = RunReference(plain, loaded),
                     spring = RunReference(sprung, Swing(plain));
  ASSERT_TRUE(load.summary.ok()) << load.summary.message;
  for (Eigen::Index i = 0; i < load.trace.values.rows(); ++i) {
    const double t = load.trace.time_s[static_cast<size_t>(i)];
    EXPECT_NEAR(At(load.trace, i, "motor.force"), At(spring.trace, i, "motor.force") - 0.7 * t,
                1e-13);
    const double rate = At(load.trace, i, "motor.velocity");
    const double q = At(load.trace, i, "motor.position");
    EXPECT_NEAR(At(load.trace, i, "power.loads"), (-3 * (q - 0.4) - 0.2 * rate + 0.7 * t) * rate,
                1e-12);
  }
  loaded.loads = {Follower(3.0, 0.2 * 1.001, 0.7)};
  const ReferenceRun perturbed = RunReference(plain, loaded);
  EXPECT_GT((ColumnOf(perturbed.trace, "motor.force") - ColumnOf(load.trace, "motor.force"))
                .cwiseAbs()
                .maxCoeff(),
            1e-4);
}

TEST(StateLoads, MoveAFreeBarAsTheSpringDoes) {
  const Mechanism plain = MakePivotedBar();
  Mechanism sprung = plain;
  sprung.elements = {{.name = "k", .joint = 0, .law = SpringLaw{{3.0}, 0.4}},
                     {.name = "c", .joint = 0, .law = DampingLaw{0.2}}};
  Motion motion = FreeMotion(plain, 0.1, 1.0, 1.0);
  const ForwardRun spring = RunForwardReference(sprung, motion);
  motion.loads = {Follower(3.0, 0.2, 0.0)};
  const ForwardRun load = RunForwardReference(plain, motion);
  ASSERT_TRUE(load.summary.ok()) << load.summary.message;
  EXPECT_LT((ColumnOf(load.trace, "motor.position") - ColumnOf(spring.trace, "motor.position"))
                .cwiseAbs()
                .maxCoeff(),
            1e-9);
}

// Through three rotations, and from ten rotations beside home.
TEST(StateLoads, CountRotationsOfWhatTheyFollowInCommandedMotion) {
  const Mechanism m = MakePivotedBar(0.0);
  for (const double start : {0.3, 0.3 + 20 * std::numbers::pi + 1.0}) {
    for (const Coordinate& coordinate : kAnglesOfBar) {
      const Profile turning{{ConstantTerm{start}, RampTerm{6.0 * std::numbers::pi}}};
      Motion motion = DriveMotion(m, {turning}, 1.0, 0.05);
      motion.loads = {SpringOn(coordinate, 3.0)};
      const ReferenceRun run = RunReference(m, motion);
      ASSERT_TRUE(run.summary.ok()) << run.summary.message;
      // Joints and drives count from home; an output that nothing commands begins next to it.
      const bool output = coordinate.kind == Coordinate::Kind::kOutput;
      const double first = output && start > 1.0 ? 1.3 : start;
      for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
        const double angle = first + 6.0 * std::numbers::pi * 0.05 * static_cast<double>(i);
        EXPECT_NEAR(At(run.trace, i, "motor.force"), 3.0 * (angle - 0.4), 1e-9)
            << start << " " << i;
      }
    }
  }
}

TEST(StateLoads, CountAnOutputFromItsCommand) {
  const Mechanism m = MakePivotedBar(0.0);
  Motion motion;
  motion.duration_s = 1.0;
  motion.sample_s = 0.05;
  const double start = 20 * std::numbers::pi + 1.3;
  motion.commands = {Commanded("bar.yaw", Coordinate::Kind::kOutput, 0, 5,
                               {{ConstantTerm{start}, RampTerm{9.0}}})};
  motion.loads = {SpringOn(kAnglesOfBar[2], 3.0)};
  const ReferenceRun run = RunReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double angle = start + 9.0 * 0.05 * static_cast<double>(i);
    EXPECT_NEAR(At(run.trace, i, "motor.force"), 3.0 * (angle - 0.4), 1e-9) << i;
  }
}

// J q̈ = −k (q − 0.4), far beyond half a rotation.
TEST(StateLoads, CountRotationsOfWhatTheyFollowInFreeMotion) {
  const Mechanism m = MakePivotedBar(0.0);
  const double inertia = 0.02 + 1.3 * 0.2 * 0.2, k = 0.5, w = std::sqrt(k / inertia);
  for (const Coordinate& coordinate : kAnglesOfBar) {
    Motion motion = FreeMotion(m, 0.4, 40.0, 2.0);
    motion.loads = {SpringOn(coordinate, k)};
    const ForwardRun run = RunForwardReference(m, motion);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const VecX angle = ColumnOf(run.trace, "motor.position");
    for (Eigen::Index i = 0; i < angle.size(); ++i) {
      const double t = run.trace.time_s[static_cast<size_t>(i)];
      EXPECT_NEAR(angle[i], 0.4 + 40.0 / w * std::sin(w * t), 1e-8) << i;
    }
    EXPECT_GT(angle.maxCoeff(), 4.0 * std::numbers::pi);
  }
}

// Named with component, coordinate and time.
TEST(StateLoads, ThatAreNotFiniteAreNamed) {
  const Mechanism m = MakePivotedBar();
  for (const bool infinite : {false, true}) {
    const Load load = NotFiniteBeyond(0.9, infinite);
    Motion commanded = DriveMotion(m, {{{ConstantTerm{0.3}, RampTerm{1.0}}}}, 1.0, 0.1);
    commanded.loads = {load};
    Motion free = FreeMotion(m, 0.3, 6.0, 1.0);
    free.loads = {load};
    for (const RunSummary& summary :
         {RunReference(m, commanded).summary, RunForwardReference(m, free).summary}) {
      EXPECT_TRUE(NamesTheLoad(summary, infinite)) << summary.message;
      EXPECT_GT(summary.time_s, 0.05);
    }
  }
}

TEST(StateForces, MoveAFreeBarAsTheSpringAndTheDamperDo) {
  const Mechanism plain = MakePivotedBar();
  Mechanism sprung = plain;
  sprung.elements = {{.name = "k", .joint = 0, .law = SpringLaw{{3.0}, 0.4}},
                     {.name = "c", .joint = 0, .law = DampingLaw{0.2}}};
  Motion motion = FreeMotion(plain, 0.1, 1.0, 1.0);
  const ForwardRun spring = RunForwardReference(sprung, motion);
  motion.forces[0].following = Follower(3.0, 0.2, 0.0).following[0].function;
  const ForwardRun driven = RunForwardReference(plain, motion);
  ASSERT_TRUE(driven.summary.ok()) << driven.summary.message;
  const VecX difference =
      ColumnOf(driven.trace, "motor.position") - ColumnOf(spring.trace, "motor.position");
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), 1e-12);
  // Its work is the drive's.
  const VecX balance = ColumnOf(driven.trace, "energy.kinetic") +
                       ColumnOf(driven.trace, "energy.gravity") -
                       ColumnOf(driven.trace, "motor.work");
  EXPECT_LT((balance.array() - balance[0]).abs().maxCoeff(), 1e-11);
  motion.forces[0].following = NotFiniteBeyond(0.105, true).following[0].function;
  const ForwardRun ended = RunForwardReference(plain, motion);
  EXPECT_EQ(ended.summary.where, "forces.motor");
  EXPECT_NE(ended.summary.message.find("pivot.position = "), std::string::npos);
}

}  // namespace
}  // namespace mbv::fixtures
