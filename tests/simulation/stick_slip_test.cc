// Dry friction in the simulation's free motion against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "reference/forward.h"
#include "simulation/simulation.h"
#include "tests/stacked_blocks.h"

namespace mbv {
namespace {

using fixtures::CoulombFriction;
using fixtures::JumpingFriction;
using fixtures::StackedBlocks;

SimulationRun SlipFreely(const Mechanism& m, const Motion& motion, double step_s = 1e-3,
                         Engine engine = Engine::kCorrected) {
  SimulationOptions options;
  options.step_s = step_s;
  options.engine = engine;
  const RunSummary start = InitialStates(m, motion, &options.start);
  EXPECT_TRUE(start.ok()) << start.message;
  const auto driven = [&m, &motion](double t_s, DrivenSample* at) {
    at->position.setZero(static_cast<Eigen::Index>(m.drives.size()));
    at->velocity = at->acceleration = at->position;
    for (const Command& command : motion.commands) {
      const Jet jet = Evaluate(command.profile, t_s);
      const int d = command.terms.front().coordinate.index;
      at->position[d] = jet.value;
      at->velocity[d] = jet.rate;
      at->acceleration[d] = jet.acceleration;
    }
    return RunSummary::Done();
  };
  return Simulate(m, motion, driven, options);
}

template <typename Truth>
double Farthest(const Trace& trace, const char* channel, const Truth& truth) {
  const int column = trace.Find(channel);
  double error = 0.0;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const double value = column < 0 ? kNan : trace.values(static_cast<Eigen::Index>(i), column);
    const double off = std::abs(value - truth(trace.time_s[i]));
    if (!(off <= error)) error = off;
  }
  return error;
}

TEST(SimulatedStickSlip, ASlidingBlockStopsAndStays) {
  const double mass = 2.0, force = 3.0, v0 = 1.7, a = force / mass, stop = v0 / a;
  const Mechanism m = StackedBlocks{{mass}, {CoulombFriction(force)}}.Make();
  for (const double sense : {1.0, -1.0}) {
    const SimulationRun run = SlipFreely(m, StackedBlocks::From(m, 0.1, sense * v0, 2.0));
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const auto x = [&](double t) {
      const double s = std::min(t, stop);
      return 0.1 + sense * (v0 * s - 0.5 * a * s * s);
    };
    EXPECT_LT(Farthest(run.trace, "motor1.position", x), 1e-10);
    EXPECT_NEAR(run.trace.values(run.trace.values.rows() - 1, run.trace.Find("dampers.work")),
                -0.5 * mass * v0 * v0, 1e-10);
  }
}

TEST(SimulatedStickSlip, ASpringSwingsBackByTwoFrictionForcesLessEachTime) {
  const double mass = 2.0, k = 50.0, coulomb = 1.1, x0 = 0.35, w = std::sqrt(k / mass);
  for (const double breakaway : {coulomb, 2.5 * coulomb}) {
    const Mechanism m = StackedBlocks{{mass}, {JumpingFriction(coulomb, breakaway)}, k}.Make();
    const SimulationRun run = SlipFreely(m, StackedBlocks::From(m, x0, 0.0, 6.0));
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const auto x = [&](double t) {
      double from = x0, left = t;
      while (std::abs(k * from) > breakaway) {
        const double middle = std::copysign(coulomb / k, from);
        if (left < std::numbers::pi / w) return middle + (from - middle) * std::cos(w * left);
        from = 2.0 * middle - from;
        left -= std::numbers::pi / w;
      }
      return from;
    };
    EXPECT_LT(Farthest(run.trace, "motor1.position", x), 1e-8);
  }
}

TEST(SimulatedStickSlip, AGrowingForceBreaksABlockAwayAtItsBreakaway) {
  const double mass = 1.5, coulomb = 2.0, breakaway = 3.3, r = 4.0, start = breakaway / r;
  const Mechanism m = StackedBlocks{{mass}, {JumpingFriction(coulomb, breakaway)}}.Make();
  Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.5);
  motion.forces[0].force = {{RampTerm{.rate = r}}};
  const SimulationRun run = SlipFreely(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto v = [&](double t) {
    return t < start ? 0.0 : (0.5 * r * (t * t - start * start) - coulomb * (t - start)) / mass;
  };
  EXPECT_LT(Farthest(run.trace, "motor1.velocity", v), 1e-9);
}

// MuJoCo decides who holds whom.
TEST(SimulatedStickSlip, TwoBlocksRestMoveTogetherOrSlip) {
  const double lower = 2.0, upper = 1.0, ground = 3.0, between = 1.5;
  const Mechanism m =
      StackedBlocks{{lower, upper}, {CoulombFriction(ground), CoulombFriction(between)}}.Make();
  const double together = ground + (lower + upper) * between / upper;
  for (const double force : {0.9 * ground, 0.5 * (ground + together), 1.4 * together}) {
    Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.0);
    motion.forces[0].force = Constant(force);
    const SimulationRun run = SlipFreely(m, motion);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const bool slips = force > together;
    const double a = force < ground ? 0.0
                     : slips        ? (force - ground - between) / lower
                                    : (force - ground) / (lower + upper);
    const double relative = slips ? between / upper - a : 0.0;
    EXPECT_LT(Farthest(run.trace, "motor1.position", [&](double t) { return a * t * t / 2; }),
              1e-9);
    EXPECT_LT(
        Farthest(run.trace, "motor2.position", [&](double t) { return relative * t * t / 2; }),
        1e-9);
  }
}

// Events leave the order of the scheme: a quarter of the step, far less than a sixteenth.
TEST(SimulatedStickSlip, ConvergesWithTheStep) {
  const FrictionLaw law{.coulomb = 1.0, .breakaway = 2.0, .stribeck_rate = 0.3};
  const Mechanism m = StackedBlocks{{1.0}, {law}, 30.0}.Make();
  Motion motion = StackedBlocks::From(m, 0.0, 0.0, 5.0);
  motion.forces[0].force = {{SineTerm{4.0, 1.7, 0.0}}};
  const ForwardRun reference = RunForwardReference(m, motion);
  ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
  const auto error = [&](double step_s, Engine engine) {
    const SimulationRun run = SlipFreely(m, motion, step_s, engine);
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
    const int x = run.trace.Find("motor1.position");
    return (run.trace.values.col(x) - reference.trace.values.col(x)).cwiseAbs().maxCoeff();
  };
  const double coarse = error(4e-3, Engine::kCorrected), fine = error(1e-3, Engine::kCorrected);
  EXPECT_LT(fine, coarse / 50.0) << coarse;
  EXPECT_LT(fine, 1e-7);
}

// MuJoCo's own rows have a time constant of 20 ms, whatever the step: it creeps at rest and stops
// late, and smaller steps do not help.
TEST(SimulatedStickSlip, MuJoCosOwnFrictionlossDoesNotConvergeWithTheStep) {
  const double mass = 2.0, k = 50.0, coulomb = 1.1, x0 = 0.35;
  const Mechanism m = StackedBlocks{{mass}, {CoulombFriction(coulomb)}, k}.Make();
  const Motion motion = StackedBlocks::From(m, x0, 0.0, 6.0);
  const ForwardRun reference = RunForwardReference(m, motion);
  ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
  for (const double step_s : {1e-3, 1e-4}) {
    const SimulationRun run = SlipFreely(m, motion, step_s, Engine::kStock);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const int x = run.trace.Find("motor1.position");
    const double error =
        (run.trace.values.col(x) - reference.trace.values.col(x)).cwiseAbs().maxCoeff();
    EXPECT_GT(error, 1e-3) << step_s;
    EXPECT_LT(error, 1e-2) << step_s;
  }
}

TEST(SimulatedStickSlip, WhatIsNotKnownIsRefused) {
  Mechanism m = StackedBlocks{{2.0, 1.0}, {CoulombFriction(1.0), CoulombFriction(0.5)}}.Make();
  Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.0);
  motion.forces.erase(motion.forces.begin());
  motion.initial.erase(motion.initial.begin());
  motion.commands = {{.name = "motor1",
                      .terms = {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}},
                      .profile = {{RampTerm{.rate = 1.0}}}}};
  EXPECT_EQ(SlipFreely(m, motion).summary.where, "dry1");
  m.elements[0].law = FrictionLaw{};
  EXPECT_TRUE(SlipFreely(m, motion).summary.ok());
  m.elements[1].law = FrictionLaw{.coefficient = 0.1};
  EXPECT_NE(SlipFreely(m, motion).summary.message.find("by the joint's load"), std::string::npos);
  m.elements[1].law = JumpingFriction(0.5, 0.6);
  EXPECT_NE(SlipFreely(m, motion, 1e-3, Engine::kStock).summary.message.find("frictionloss"),
            std::string::npos);
}

}  // namespace
}  // namespace mbv
