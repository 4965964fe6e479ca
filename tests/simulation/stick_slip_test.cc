// Dry friction in the simulation's free motion against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "model_file/load_model.h"
#include "reference/forward.h"
#include "simulation/engine/simulation.h"
#include "tests/mechanisms/friction_pendulum.h"
#include "tests/mechanisms/pushed_block.h"
#include "tests/mechanisms/stacked_blocks.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using fixtures::BouncingBlock;
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

TEST(SimulatedStickSlip, AFreewheelHoldsOneWay) {
  const fixtures::RatchetedBlock block;
  const Mechanism m = block.Make();
  const SimulationRun run = SlipFreely(m, block.Pushed(m, 5.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto x = [](const fixtures::RatchetedBlock& of) {
    return [of](double t) { return of.Position(t); };
  };
  EXPECT_LT(Farthest(run.trace, "motor1.position", x(block)), 1e-9);
  EXPECT_GT(Farthest(run.trace, "motor1.position", x({.B = block.B * (1.0 + 1e-6)})), 1e-7);
  ASSERT_EQ(run.trace.events.size(), 5U);
  for (size_t i = 0; i < 5; ++i) {
    const MotionEvent& event = run.trace.events[i];
    EXPECT_EQ(event.what, i % 2 == 0 ? Happening::kSlidesUp : Happening::kRests);
    EXPECT_NEAR(event.time_s, block.EventTime(i), 1e-8);
  }
  const SimulationRun stock = SlipFreely(m, block.Pushed(m, 1.0), 1e-3, Engine::kStock);
  EXPECT_EQ(stock.summary.stop, Stop::kUnsupported);
  EXPECT_EQ(stock.summary.where, "dry1");
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

// Flies to a stop, swings half a period there and flies back; the same by a curve with a corner.
TEST(SimulatedPieces, AStopReturnsWhatMeetsItAtFourthOrder) {
  const double mass = 2.0, k = 800.0, gap = 0.2, v0 = 1.5, w = std::sqrt(k / mass);
  const double meets = gap / v0, leaves = meets + std::numbers::pi / w;
  const auto x = [&](double t) {
    if (t < meets) return v0 * t;
    return t < leaves ? gap + v0 / w * std::sin(w * (t - meets)) : gap - v0 * (t - leaves);
  };
  Mechanism m = StackedBlocks{{mass}, {CoulombFriction(0.0)}}.Make();
  const auto error = [&](double step_s) {
    const SimulationRun run = SlipFreely(m, StackedBlocks::From(m, 0.0, v0, 0.6), step_s);
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
    return Farthest(run.trace, "motor1.position", x);
  };
  m.elements[0].law = StopLaw{.upper = gap, .stiffness = k};
  const double coarse = error(2e-3), fine = error(5e-4);
  EXPECT_LT(coarse, 2e-6);
  EXPECT_LT(fine, coarse / 100.0);  // 256 where corners cost nothing
  m.elements[0].law = CurveLaw{.knots = {{gap, 0.0, 0.0, -k}, {gap + 0.01, -0.01 * k, -k, -k}}};
  EXPECT_LT(error(5e-4), 2.0 * fine);
  m.elements[0].law = StopLaw{.upper = gap, .stiffness = k * (1.0 + 1e-4)};
  EXPECT_GT(error(5e-4), 10.0 * fine);
}

TEST(SimulatedPieces, AStopWithDissipationLosesWhatItsIntegralSays) {
  const double mass = 2.0, gap = 0.2, v0 = 1.5;
  const StopLaw law{.upper = gap, .stiffness = 4e3, .exponent = 2.0, .dissipation = 0.3};
  const double a = law.dissipation;
  const auto integral = [&](double v) { return v / a - std::log1p(a * v) / (a * a); };
  Mechanism m = StackedBlocks{{mass}, {CoulombFriction(0.0)}}.Make();
  m.elements[0].law = law;
  const SimulationRun run = SlipFreely(m, StackedBlocks::From(m, 0.0, v0, 0.6), 5e-4);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto last = [&](const char* channel) {
    return run.trace.values(run.trace.values.rows() - 1, run.trace.Find(channel));
  };
  const double v = last("motor1.velocity");
  EXPECT_LT(v, -0.5);
  EXPECT_NEAR(integral(v), integral(v0), 1e-8);
  EXPECT_NEAR(last("dampers.work"), 0.5 * mass * (v * v - v0 * v0), 1e-7);
}

TEST(SimulatedPieces, CurvesAtRatesAndExpressionsAreTheSpringAndDamperThatTheyDescribe) {
  const double mass = 2.0, k = 80.0, v0 = 1.5, c = 4.0, decay = c / (2.0 * mass);
  const double w = std::sqrt(k / mass - decay * decay);
  const auto swing = [&](double t) { return v0 / w * std::exp(-decay * t) * std::sin(w * t); };
  Mechanism m = StackedBlocks{{mass}, {CoulombFriction(0.0)}}.Make();
  const auto error = [&](double damping, bool as_curves) {
    CurvesLaw law{.rates = {-2.0, 0.5, 3.0}, .curves = {}};
    for (const double rate : law.rates) {
      law.curves.push_back({.knots = {{-0.05, 0.05 * k - damping * rate, -k, -k},
                                      {0.02, -0.02 * k - damping * rate, -k, -k}}});
    }
    m.elements[0].law = law;
    if (!as_curves) {
      m.elements[0].law = ExpressionLaw{
          .text = "", .force = [=](double x, double v) { return -k * x - damping * v; }};
    }
    const SimulationRun run = SlipFreely(m, StackedBlocks::From(m, 0.0, v0, 0.6), 5e-4);
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
    return Farthest(run.trace, "motor1.position", swing);
  };
  for (const bool as_curves : {true, false}) {
    EXPECT_LT(error(c, as_curves), 1e-10);
    EXPECT_GT(error(c * (1.0 + 1e-6), as_curves), 1e-8);
  }
}

TEST(SimulatedPieces, AnExpressionThatJumpsIsFollowedAcross) {
  const fixtures::JumpingForce law;
  Mechanism m = StackedBlocks{{law.mass}, {CoulombFriction(0.0)}}.Make();
  const auto run_of = [&](const fixtures::JumpingForce& of) {
    m.elements[0].law = of.Law();
    const SimulationRun run = SlipFreely(m, StackedBlocks::From(m, 0.0, law.v0, 0.6), 1e-3);
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
    return run;
  };
  const auto position = [&](double t) { return law.Position(t); };
  const SimulationRun run = run_of(law);
  EXPECT_LT(Farthest(run.trace, "motor1.position", position), 1e-12);
  ASSERT_EQ(run.trace.events.size(), 2u);
  EXPECT_NEAR(run.trace.events[0].time_s, law.passes(), 1e-12);
  EXPECT_NEAR(run.trace.events[1].time_s, law.returns(), 1e-12);
  const auto last = run.trace.values.rows() - 1;
  const double v = run.trace.values(last, run.trace.Find("motor1.velocity"));
  EXPECT_NEAR(run.trace.values(last, run.trace.Find("dampers.work")),
              0.5 * law.mass * (v * v - law.v0 * law.v0), 1e-11);
  EXPECT_GT(
      Farthest(run_of({.beyond = law.beyond * (1.0 + 1e-7)}).trace, "motor1.position", position),
      1e-9);
}

TEST(SimulatedRigidStops, ABlockBouncesAsItsClosedFormAndRests) {
  const BouncingBlock block;
  Mechanism m = block.Make();
  const auto error = [&] {
    const SimulationRun run = SlipFreely(m, BouncingBlock::Thrown(m, 1.0), 1e-3);
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
    const double energy = 0.5 * block.mass * block.v0 * block.v0;
    EXPECT_NEAR(run.trace.values(run.trace.values.rows() - 1, run.trace.Find("dampers.work")),
                -energy, 1e-5 * energy);
    return Farthest(run.trace, "motor1.position", [&](double t) { return block.Position(t); });
  };
  EXPECT_LT(error(), 1e-10);  // where it rests, by the softness of the row that holds it
  m = BouncingBlock{.restitution = 0.6 * (1.0 + 1e-6)}.Make();
  EXPECT_GT(error(), 1e-8);
}

TEST(SimulatedRigidStops, WhatLeansLeavesWhereItWouldBePulled) {
  const fixtures::RatchetedBlock ratchet;
  Mechanism m = ratchet.Make();
  m.elements[0].law = StopLaw{.lower = 0.0, .restitution = 0.0};
  const double duration_s = ratchet.start() + ratchet.moves();
  const SimulationRun run = SlipFreely(m, ratchet.Pushed(m, duration_s), 1e-3);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_LT(Farthest(run.trace, "motor1.position",
                     [&](double t) {
                       return t < ratchet.start() ? 0.0 : ratchet.Way(t - ratchet.start());
                     }),
            1e-9);
  const SimulationRun stock = SlipFreely(m, ratchet.Pushed(m, 0.1), 1e-3, Engine::kStock);
  EXPECT_EQ(stock.summary.stop, Stop::kUnsupported);
  EXPECT_EQ(stock.summary.where, m.elements[0].name);
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

double Apart(const SimulationRun& run, const ForwardRun& reference, const char* channel) {
  EXPECT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_TRUE(reference.summary.ok()) << reference.summary.message;
  const int a = run.trace.Find(channel), b = reference.trace.Find(channel);
  return (run.trace.values.col(a) - reference.trace.values.col(b)).cwiseAbs().maxCoeff();
}

// From breakaway on, with the load that the push leaves; a wrong coefficient shows.
TEST(SimulatedStickSlip, FrictionByLoadIsThatOfThePushedBlock) {
  const fixtures::PushedBlock block;
  const Mechanism m = block.Make();
  Motion motion = StackedBlocks::From(m, 0.5, 0.0, 1.0);
  motion.forces[0].force = {{RampTerm{.rate = 6.0}}};
  const ForwardRun reference = RunForwardReference(m, motion);
  EXPECT_LT(Apart(SlipFreely(m, motion), reference, "leg.position"), 1e-10);
  EXPECT_LT(Apart(SlipFreely(m, motion), reference, "rail.reaction.fz"), 1e-7);
  EXPECT_LT(Apart(SlipFreely(m, motion), reference, "dampers.work"), 1e-9);
  const Mechanism perturbed = fixtures::PushedBlock{.coefficient = 0.25 + 1e-4}.Make();
  EXPECT_GT(Apart(SlipFreely(perturbed, motion), reference, "leg.position"), 1e-6);
}

TEST(SimulatedStickSlip, FrictionOfAFreeJournalIsByTheLoadOfItsAccelerations) {
  const fixtures::JournalPendulum p;
  const Mechanism m = p.Make();
  const Motion motion = StackedBlocks::From(m, 0.3, 5.0, 4.0);
  const ForwardRun reference = RunForwardReference(m, motion);
  const SimulationRun run = SlipFreely(m, motion);
  EXPECT_LT(Apart(run, reference, "motor.position"), 1e-7);
  EXPECT_LT(Apart(run, reference, "pivot.reaction.fx"), 1e-6);
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const auto at = [&](const char* name) { return run.trace.values(i, run.trace.Find(name)); };
    if (std::abs(at("motor.velocity")) < 1e-6) continue;
    const double rest =
        p.FreeTorque(at("motor.position"), at("motor.velocity"), at("motor.acceleration"));
    EXPECT_NEAR(rest, 0.0, 1e-9) << i;
  }
}

// A loop of one DOF stops as a whole, whatever the step's own error leaves in its rates: what
// its joints bear at rest does not depend on the step.
TEST(SimulatedStickSlip, WhatALoopHoldsRestsWithItAtAnyStep) {
  const LoadResult loaded = LoadModel(std::string(kSourceDir) + "/models/journal_crank/model.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value());
  const Mechanism& m = *loaded.mechanism;
  const Motion motion = StackedBlocks::From(m, std::numbers::pi * 2.0 / 9.0, 0.0, 1.4);
  const auto at_rest = [](const SimulationRun& run, const char* channel) -> VecX {
    return run.trace.values.col(run.trace.Find(channel)).tail(40);  // it stops at 0.95 s
  };
  const SimulationRun fine = SlipFreely(m, motion, 2.5e-4);
  ASSERT_TRUE(fine.summary.ok()) << fine.summary.message;
  for (const double step_s : {5e-4, 1e-3, 2e-3}) {
    const SimulationRun run = SlipFreely(m, motion, step_s);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_LT(at_rest(run, "motor.velocity").cwiseAbs().maxCoeff(), 1e-8) << step_s;
    for (const char* channel : {"B.reaction.fx", "B.reaction.fy", "C.reaction.fx"}) {
      const VecX truth = at_rest(fine, channel), off = at_rest(run, channel) - truth;
      EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-5 * truth.norm()) << channel << ", " << step_s;
    }
  }
}

TEST(SimulatedStickSlip, FrictionOnACommandedCoordinateIsItsDrives) {
  const Mechanism m =
      StackedBlocks{{2.0, 1.0}, {CoulombFriction(1.3), CoulombFriction(0.5)}}.Make();
  Motion motion = StackedBlocks::From(m, 0.0, 0.0, 2.0);
  motion.forces.erase(motion.forces.begin());
  motion.initial.erase(motion.initial.begin());
  motion.commands = {{.name = "motor1",
                      .terms = {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}},
                      .profile = {{SineTerm{0.05, 1.1, 0.0}}}}};
  const ForwardRun reference = RunForwardReference(m, motion);
  const SimulationRun run = SlipFreely(m, motion);
  EXPECT_LT(Apart(run, reference, "motor2.position"), 1e-8);
  EXPECT_LT(Apart(run, reference, "motor1.force"), 1e-6);
  motion.commands[0].profile = {{ConstantTerm{0.0}}};
  const SimulationRun held = SlipFreely(m, motion);
  EXPECT_NEAR(held.trace.values(50, held.trace.Find("motor1.force.band")), 1.3, 1e-12);
  EXPECT_EQ(held.trace.values(50, held.trace.Find("motor2.force.band")), 0.0);
}

TEST(SimulatedStickSlip, PushedInOpenLoopIsRefused) {
  const Mechanism m = StackedBlocks{{2.0}, {CoulombFriction(0.5)}}.Make();
  const Motion motion{.duration_s = 1.0, .sample_s = 0.1, .commands = {}, .loads = {}};
  SimulationOptions options{.mode = DriveMode::kForceDriven};
  options.forces = [](double, VecX* force) {
    *force = VecX::Ones(1);
    return RunSummary::Done();
  };
  const auto still = [](double, DrivenSample* at) {
    at->position = at->velocity = at->acceleration = VecX::Zero(1);
    return RunSummary::Done();
  };
  const RunSummary summary = Simulate(m, motion, still, options).summary;
  EXPECT_EQ(summary.stop, Stop::kUnsupported);
  EXPECT_EQ(summary.where, "dry1");
  EXPECT_NE(summary.message.find("in open loop"), std::string::npos) << summary.message;
}

TEST(SimulatedStickSlip, WhatMuJoCoByItselfLacksIsRefused) {
  Mechanism m = StackedBlocks{{2.0}, {JumpingFriction(0.5, 0.6)}}.Make();
  const Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.0);
  const RunSummary jumps = SlipFreely(m, motion, 1e-3, Engine::kStock).summary;
  EXPECT_EQ(jumps.where, "dry1");
  EXPECT_NE(jumps.message.find("frictionloss"), std::string::npos);
  m.elements[0].law = FrictionLaw{.coefficient = 0.1};
  const RunSummary by_load = SlipFreely(m, motion, 1e-3, Engine::kStock).summary;
  EXPECT_EQ(by_load.where, "dry1");
  EXPECT_NE(by_load.message.find("no load of the joint"), std::string::npos);
}

}  // namespace
}  // namespace mbv
