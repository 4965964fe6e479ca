// Dry friction in free motion of the reference against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "model_file/load_model.h"
#include "reference/forward.h"
#include "reference/rest_decision.h"
#include "tests/reference/fixture.h"
#include "tests/shipped.h"
#include "tests/stacked_blocks.h"

namespace mbv::fixtures {
namespace {

constexpr double kPi = std::numbers::pi;
// What steps of tolerance 1e-12 leave, events included.
constexpr double kFollowed = 1e-10;

template <typename Truth>
double LargestError(const Trace& trace, const char* channel, const Truth& truth) {
  const VecX column = ColumnOf(trace, channel);
  double error = 0.0;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const double off = std::abs(column[static_cast<Eigen::Index>(i)] - truth(trace.time_s[i]));
    if (!(off <= error)) error = off;
  }
  return error;
}

// Energy less what drives put in and friction takes.
double Unbalanced(const Trace& trace) {
  VecX sum = ColumnOf(trace, "energy.kinetic") + ColumnOf(trace, "energy.springs") -
             ColumnOf(trace, "dampers.work");
  for (int d = 1; trace.Find("motor" + std::to_string(d) + ".work") >= 0; ++d) {
    sum -= ColumnOf(trace, "motor" + std::to_string(d) + ".work");
  }
  return (sum.array() - sum[0]).abs().maxCoeff();
}

TEST(StickSlip, ASlidingBlockStopsAndStays) {
  const double mass = 2.0, force = 3.0, v0 = 1.7, a = force / mass, stop = v0 / a;
  const Mechanism m = StackedBlocks{{mass}, {CoulombFriction(force)}}.Make();
  for (const double sense : {1.0, -1.0}) {
    const ForwardRun run = RunForwardReference(m, StackedBlocks::From(m, 0.1, sense * v0, 2.0));
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const auto x = [&](double t) {
      const double s = std::min(t, stop);
      return 0.1 + sense * (v0 * s - 0.5 * a * s * s);
    };
    EXPECT_LT(LargestError(run.trace, "motor1.position", x), 1e-12);
    const auto v = [&](double t) { return sense * (v0 - a * std::min(t, stop)); };
    EXPECT_LT(LargestError(run.trace, "motor1.velocity", v), 1e-12);
    EXPECT_NEAR(ColumnOf(run.trace, "dampers.work").tail<1>()[0], -0.5 * mass * v0 * v0, 1e-12);
    EXPECT_EQ(ColumnOf(run.trace, "motor1.velocity").tail<1>()[0], 0.0);
    EXPECT_LT(run.uncertainty, 1e-12);
  }
}

// Swings about ±Fc/k lose 2 Fc/k each, until the spring cannot break friction away.
TEST(StickSlip, ASpringSwingsBackByTwoFrictionForcesLessEachTime) {
  const double mass = 2.0, k = 50.0, coulomb = 1.1, x0 = 0.35, w = std::sqrt(k / mass);
  for (const double breakaway : {coulomb, 2.5 * coulomb}) {
    const Mechanism m = StackedBlocks{{mass}, {JumpingFriction(coulomb, breakaway)}, k}.Make();
    const ForwardRun run = RunForwardReference(m, StackedBlocks::From(m, x0, 0.0, 6.0));
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const auto x = [&](double t) {
      double from = x0, left = t;
      while (std::abs(k * from) > breakaway) {
        const double middle = std::copysign(coulomb / k, from);
        if (left < kPi / w) return middle + (from - middle) * std::cos(w * left);
        from = 2.0 * middle - from;
        left -= kPi / w;
      }
      return from;
    };
    EXPECT_LT(LargestError(run.trace, "motor1.position", x), kFollowed);
    EXPECT_LT(Unbalanced(run.trace), kFollowed);
    EXPECT_LT(run.uncertainty, kFollowed);
    EXPECT_EQ(ColumnOf(run.trace, "motor1.velocity").tail<1>()[0], 0.0);
  }
}

// A force that grows evenly, from rest: F = r t sets it free at t = Fs/r.
TEST(StickSlip, AGrowingForceBreaksABlockAwayAtItsBreakaway) {
  const double mass = 1.5, coulomb = 2.0, breakaway = 3.3, r = 4.0, start = breakaway / r;
  const Mechanism m = StackedBlocks{{mass}, {JumpingFriction(coulomb, breakaway)}}.Make();
  Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.5);
  motion.forces[0].force = {{RampTerm{.rate = r}}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto v = [&](double t) {
    return t < start ? 0.0 : (0.5 * r * (t * t - start * start) - coulomb * (t - start)) / mass;
  };
  EXPECT_LT(LargestError(run.trace, "motor1.velocity", v), kFollowed);
  EXPECT_LT(Unbalanced(run.trace), kFollowed);
  // A thousandth more breakaway shows.
  const Mechanism bent =
      StackedBlocks{{mass}, {JumpingFriction(coulomb, 1.001 * breakaway)}}.Make();
  EXPECT_GT(LargestError(RunForwardReference(bent, motion).trace, "motor1.velocity", v), 1e-4);
}

// With Fs = Fc the block goes on without a jump, with Stribeck's curve it runs away.
TEST(StickSlip, StribeckFrictionFallsFromBreakawayAndBalancesEnergy) {
  for (const double stribeck : {0.05, 0.3}) {
    const FrictionLaw law{.coulomb = 1.0, .breakaway = 2.0, .stribeck_rate = stribeck};
    const Mechanism m = StackedBlocks{{1.0}, {law}, 30.0}.Make();
    Motion motion = StackedBlocks::From(m, 0.0, 0.0, 5.0);
    motion.forces[0].force = {{SineTerm{4.0, 1.7, 0.0}}};
    const ForwardRun run = RunForwardReference(m, motion);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_LT(Unbalanced(run.trace), 1e-9);
    EXPECT_LT(run.uncertainty, 1e-8);
    EXPECT_GT(ColumnOf(run.trace, "motor1.position").cwiseAbs().maxCoeff(), 0.02);
    EXPECT_LT(ColumnOf(run.trace, "dampers.work").tail<1>()[0], -0.05);
  }
}

// A force that jumps over breakaway for an instant between two samples is not missed.
TEST(StickSlip, AShortPeakOfTheForceIsSeen) {
  const Mechanism m = StackedBlocks{{1.0}, {CoulombFriction(1.0)}}.Make();
  Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.0);
  motion.sample_s = 0.1;
  motion.forces[0].force = {{BumpTerm{.start_s = 0.2, .duration_s = 0.3, .height = 1.02}}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_GT(ColumnOf(run.trace, "motor1.position").tail<1>()[0], 1e-7);
}

// The lower block is pushed: both rest, move as one, or slip, by the force.
TEST(StickSlip, TwoBlocksRestMoveTogetherOrSlip) {
  const double lower = 2.0, upper = 1.0, ground = 3.0, between = 1.5;
  const Mechanism m =
      StackedBlocks{{lower, upper}, {CoulombFriction(ground), CoulombFriction(between)}}.Make();
  const double together = ground + (lower + upper) * between / upper;
  for (const double force : {0.9 * ground, 0.5 * (ground + together), 1.4 * together}) {
    Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.0);
    motion.forces[0].force = Constant(force);
    const ForwardRun run = RunForwardReference(m, motion);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const bool slips = force > together;
    const double a = force < ground ? 0.0
                     : slips        ? (force - ground - between) / lower
                                    : (force - ground) / (lower + upper);
    const double relative = slips ? between / upper - a : 0.0;
    EXPECT_LT(LargestError(run.trace, "motor1.position", [&](double t) { return a * t * t / 2; }),
              1e-11);
    EXPECT_LT(
        LargestError(run.trace, "motor2.position", [&](double t) { return relative * t * t / 2; }),
        1e-11);
    EXPECT_LT(Unbalanced(run.trace), 1e-11);
  }
}

// One stops on the other while both slide on, then both stop at once.
TEST(StickSlip, TwoBlocksBecomeOneAndStopTogether) {
  const double lower = 2.0, upper = 1.0, ground = 3.0, between = 2.5;
  const Mechanism m =
      StackedBlocks{{lower, upper}, {CoulombFriction(ground), CoulombFriction(between)}}.Make();
  Motion motion = StackedBlocks::From(m, 0.0, 2.0, 3.0);
  motion.initial[1].rate = -1.0;  // the upper one has 1 m/s
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  // Until both have one speed; then they slow down together: ground/3 < between.
  const double a1 = -(ground + between) / lower, a2 = between / upper;
  const double one = 1.0 / (a2 - a1), v = 2.0 + a1 * one, a = -ground / (lower + upper);
  const double stop = one - v / a;
  const auto x1 = [&](double t) {
    const double s = std::min(t, one), r = std::clamp(t, one, stop) - one;
    return 2.0 * s + a1 * s * s / 2 + v * r + a * r * r / 2;
  };
  EXPECT_LT(LargestError(run.trace, "motor1.position", x1), 1e-12);
  const auto x2 = [&](double t) {
    const double s = std::min(t, one);
    return -s + (a2 - a1) * s * s / 2;
  };
  EXPECT_LT(LargestError(run.trace, "motor2.position", x2), 1e-12);
  EXPECT_LT(Unbalanced(run.trace), 1e-11);
}

// In a closed loop all joints rest at once and share the load; together they carry as much as the
// band of the commanded motion says, which other code finds.
TEST(StickSlip, JointsOfALoopBreakAwayTogether) {
  const LoadResult loaded = LoadModel(SourcePath("/models/four_bar/model.yaml"));
  ASSERT_TRUE(loaded.mechanism);
  Mechanism m = *loaded.mechanism;
  for (size_t j = 0; j < m.joints.size(); ++j) {
    ForceElement dry;
    dry.name = "dry" + std::to_string(j);
    dry.joint = static_cast<int>(j);
    dry.law = CoulombFriction(0.3 + 0.2 * static_cast<double>(j));
    m.elements.push_back(dry);
  }
  const double home = m.joints[0].home[0];
  Motion hold;
  hold.duration_s = 1.0;
  hold.sample_s = 0.5;
  hold.commands = {DriveCommand(m, 0, {{ConstantTerm{home}}})};
  const ReferenceRun held = RunReference(m, hold);
  ASSERT_TRUE(held.summary.ok()) << held.summary.message;
  const std::string motor = m.drives[0].name;
  const double middle = At(held.trace, 0, motor + ".force");
  const double band = At(held.trace, 0, motor + ".force.band");
  ASSERT_GT(band, 1.0);
  for (const double share : {-1.001, -0.999, 0.999, 1.001}) {
    Motion motion;
    motion.duration_s = 0.2;
    motion.sample_s = 0.02;
    motion.forces = {{0, Constant(middle + share * band)}};
    motion.initial = {
        {.name = motor, .coordinate = {Coordinate::Kind::kDrive, 0, 0}, .position = home}};
    const ForwardRun run = RunForwardReference(m, motion);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const double moved = ColumnOf(run.trace, motor + ".position").tail<1>()[0] - home;
    if (std::abs(share) < 1.0) {
      EXPECT_LT(std::abs(moved), 1e-13) << share;
    } else {
      EXPECT_GT(moved * share, 1e-7) << share;
    }
  }
}

// The commanded block swings; its drive bears its own friction, which the other does not feel.
TEST(StickSlip, FrictionOnACommandedCoordinateIsItsDrives) {
  const double lower = 2.0, upper = 1.0, ground = 1.3;
  const Mechanism m =
      StackedBlocks{{lower, upper}, {CoulombFriction(ground), CoulombFriction(0.5)}}.Make();
  Motion motion = StackedBlocks::From(m, 0.0, 0.0, 2.0);
  motion.forces.erase(motion.forces.begin());
  motion.initial.erase(motion.initial.begin());
  motion.commands = {DriveCommand(m, 0, {{SineTerm{0.05, 1.1, 0.0}}})};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX a1 = ColumnOf(run.trace, "motor1.acceleration"),
             a2 = ColumnOf(run.trace, "motor2.acceleration"),
             v1 = ColumnOf(run.trace, "motor1.velocity");
  const VecX inertia = (lower + upper) * a1 + upper * a2;
  const VecX rubs = ColumnOf(run.trace, "motor1.force") - inertia;
  for (Eigen::Index i = 0; i < rubs.size(); ++i) {
    EXPECT_NEAR(rubs[i], std::copysign(ground, v1[i]), 1e-11) << i;
  }
  EXPECT_LT(Unbalanced(run.trace), kFollowed);
  // Held, it may bear anything up to its breakaway; the other is held by no drive.
  motion.commands = {DriveCommand(m, 0, {{ConstantTerm{0.0}}})};
  const ForwardRun held = RunForwardReference(m, motion);
  ASSERT_TRUE(held.summary.ok()) << held.summary.message;
  EXPECT_NEAR(ColumnOf(held.trace, "motor1.force.band")[50], ground, 1e-12);
  EXPECT_EQ(ColumnOf(held.trace, "motor2.force.band")[50], 0.0);
}

// A commanded belt takes the block along; the belt's drive needs no acceleration of its own.
TEST(StickSlip, ABlockOnACommandedBeltRidesUntilItsForceBreaksItAway) {
  const double mass = 1.2, coulomb = 2.0, breakaway = 3.0, r = 5.0, speed = 0.3;
  Mechanism m =
      StackedBlocks{{1.0, mass}, {CoulombFriction(1.0), JumpingFriction(coulomb, breakaway)}}
          .Make();
  m.elements.erase(m.elements.begin());
  Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.5);
  motion.forces.erase(motion.forces.begin());
  motion.initial.erase(motion.initial.begin());
  motion.commands = {DriveCommand(m, 0, {{RampTerm{.rate = speed}}})};
  motion.forces[0].force = {{RampTerm{.rate = -r}}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double start = breakaway / r;
  const auto v = [&](double t) {
    return t < start ? 0.0 : (-0.5 * r * (t * t - start * start) + coulomb * (t - start)) / mass;
  };
  EXPECT_LT(LargestError(run.trace, "motor2.velocity", v), kFollowed);
  EXPECT_LT(Unbalanced(run.trace), kFollowed);
}

// Random systems, with more elements than freedoms as well: what is found is the least of (2).
TEST(RestDecision, FindsTheLeastOfGauss) {
  std::mt19937_64 random(20261122);
  std::normal_distribution<double> normal;
  const auto matrix = [&](Eigen::Index rows, Eigen::Index cols) {
    return MatX(MatX::NullaryExpr(rows, cols, [&] { return normal(random); }));
  };
  int sticking = 0, starting = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Index freedoms = 1 + trial % 4, elements = 1 + trial % 6;
    const MatX L = matrix(freedoms, freedoms);
    internal::RestSystem system;
    system.H = L * L.transpose() + 0.3 * MatX::Identity(freedoms, freedoms);
    system.f = 3.0 * matrix(freedoms, 1);
    system.G = matrix(elements, freedoms);
    system.d = VecX::Zero(elements);
    system.most = matrix(elements, 1).cwiseAbs().array() + 0.1;
    std::vector<int> sign;
    ASSERT_TRUE(internal::DecideRest(system, &sign)) << trial;
    const auto size = [&](const VecX& u) {
      const VecX off = u - system.H.ldlt().solve(system.f);
      return 0.5 * off.dot(system.H * off) + system.most.dot((system.G * u).cwiseAbs());
    };
    // The motion of this choice.
    internal::RestSystem held = system;
    held.G.resize(0, freedoms);
    for (Eigen::Index e = 0; e < elements; ++e) {
      const int s = sign[static_cast<size_t>(e)];
      (s == 0 ? sticking : starting) += 1;
      if (s != 0) {
        held.f -= s * system.most[e] * system.G.row(e).transpose();
        continue;
      }
      held.G.conservativeResize(held.G.rows() + 1, freedoms);
      held.G.bottomRows(1) = system.G.row(e);
    }
    held.d = VecX::Zero(held.G.rows());
    const VecX u = internal::HeldMotion(held);
    for (int other = 0; other < 40; ++other) {
      const VecX step = std::pow(10.0, -(other % 5)) * matrix(freedoms, 1);
      EXPECT_GE(size(u + step), size(u) - 1e-12) << trial;
    }
  }
  EXPECT_GT(sticking, 100);
  EXPECT_GT(starting, 100);
}

}  // namespace
}  // namespace mbv::fixtures
