// Dry friction in free motion of the reference against closed forms.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "model_file/load_model.h"
#include "reference/forward.h"
#include "reference/rest_decision.h"
#include "tests/mechanisms/stacked_blocks.h"
#include "tests/reference/fixture.h"
#include "tests/support/shipped.h"

namespace mbv::fixtures {
namespace {

constexpr double kPi = std::numbers::pi;
// What steps of tolerance 1e-12 leave, events included.
constexpr double kFollowed = 1e-10;
// In machines, over many events; fourth-order steps of their equation of motion leave 1e-10.
constexpr double kMachine = 1e-9;

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
  const Mechanism perturbed =
      StackedBlocks{{mass}, {JumpingFriction(coulomb, 1.001 * breakaway)}}.Make();
  EXPECT_GT(LargestError(RunForwardReference(perturbed, motion).trace, "motor1.velocity", v), 1e-4);
}

// With Fs = Fc the block goes on without a jump, with Stribeck's curve it runs away.
TEST(StickSlip, AFreewheelHoldsOneWay) {
  const RatchetedBlock block;
  const Mechanism m = block.Make();
  const ForwardRun run = RunForwardReference(m, block.Pushed(m, 5.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const auto x = [](const RatchetedBlock& of) { return [of](double t) { return of.Position(t); }; };
  EXPECT_LT(LargestError(run.trace, "motor1.position", x(block)), kFollowed);
  EXPECT_GT(LargestError(run.trace, "motor1.position", x({.B = block.B * (1.0 + 1e-6)})), 1e-7);
  EXPECT_EQ(ColumnOf(run.trace, "dampers.work").cwiseAbs().maxCoeff(), 0.0);
  ASSERT_EQ(run.trace.events.size(), 5U);
  for (size_t i = 0; i < 5; ++i) {
    const MotionEvent& event = run.trace.events[i];
    EXPECT_EQ(event.element, "dry1");
    EXPECT_EQ(event.what, i % 2 == 0 ? Happening::kSlidesUp : Happening::kRests);
    EXPECT_NEAR(event.time_s, block.EventTime(i), kFollowed);
  }
}

// Turned about, it holds against larger positions, and in commanded motion no drive feels it but at
// rest: between nothing and its capacity.
TEST(StickSlip, ACommandedFreewheelIsFeltOneWay) {
  for (const int resists : {1, -1}) {
    Mechanism m = RatchetedBlock().Make();
    std::get<FrictionLaw>(m.elements[0].law).resists = resists;
    const Profile profile{{SineTerm{1.0, 0.5, 0}}};
    const ReferenceRun run = RunReference(m, DriveMotion(m, {profile}, 1.0, 0.05));
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const VecX v = ColumnOf(run.trace, "motor1.velocity"),
               a = ColumnOf(run.trace, "motor1.acceleration"),
               force = ColumnOf(run.trace, "motor1.force") - RatchetedBlock::mass * a,
               band = ColumnOf(run.trace, "motor1.force.band");
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      const bool rests = i == 10, holds = v[i] * resists > 0.0;
      const double capacity = resists * RatchetedBlock::capacity;
      EXPECT_NEAR(force[i], rests ? 0.5 * capacity : holds ? capacity : 0.0, 1e-10) << i;
      EXPECT_NEAR(band[i], rests ? 0.5 * RatchetedBlock::capacity : 0.0, 1e-12) << i;
    }
  }
}

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

// A force that is above breakaway for an instant is not missed: neither between two samples nor,
// with its peak at 0.335 s, between the quarters of the step from 0.3 to 0.4 s.
TEST(StickSlip, AShortPeakOfTheForceIsSeen) {
  const Mechanism m = StackedBlocks{{1.0}, {CoulombFriction(1.0)}}.Make();
  for (const BumpTerm& bump : {BumpTerm{.start_s = 0.2, .duration_s = 0.3, .height = 1.02},
                               BumpTerm{.start_s = 0.2, .duration_s = 0.27, .height = 1.01}}) {
    Motion motion = StackedBlocks::From(m, 0.0, 0.0, 1.0);
    motion.sample_s = 0.1;
    motion.forces[0].force = {{bump}};
    const ForwardRun run = RunForwardReference(m, motion);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_GT(ColumnOf(run.trace, "motor1.position").tail<1>()[0], 1e-7);
  }
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
  const VecX friction = ColumnOf(run.trace, "motor1.force") - inertia;
  for (Eigen::Index i = 0; i < friction.size(); ++i) {
    EXPECT_NEAR(friction[i], std::copysign(ground, v1[i]), 1e-11) << i;
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

// A machine of one DOF q with friction in some coordinates, whose rates are k_e(q) q̇:
//   J q̈ + ½ J' q̇² + V' + Σ F_e |k_e| sign q̇ = 0,  F_e = Fc or μ N_e(q, q̇, q̈, sign).
struct OneDof {
  using Function = std::function<double(double)>;
  struct Friction {
    double force = 0.0;
    Function k;
    std::function<double(double q, double v, double a, int sign)> by_load = {};
  };
  Function J, V;
  std::vector<Friction> frictions;
  struct At {
    double q = 0.0, v = 0.0;
  };

  static double Slope(const Function& f, double q) {  // eighth-order differences
    constexpr double h = 4e-3;
    const auto d = [&](int k) { return f(q + k * h) - f(q - k * h); };
    return (672 * d(1) - 168 * d(2) + 32 * d(3) - 3 * d(4)) / (840 * h);
  }
  // The sign of each k_e q̇ is given: it does not jump within a step.
  [[nodiscard]] double Acceleration(const At& x, const std::vector<int>& sign) const {
    const double J_q = J(x.q), without = -0.5 * Slope(J, x.q) * x.v * x.v - Slope(V, x.q);
    std::vector<double> k;
    for (const Friction& friction : frictions) k.push_back(friction.k(x.q));
    double a = without / J_q;
    for (int pass = 0; pass < 60; ++pass) {  // loads follow the acceleration
      const double last = a;
      double force = without;
      for (size_t e = 0; e < sign.size(); ++e) {
        const auto& by_load = frictions[e].by_load;
        const double size = frictions[e].force + (by_load ? by_load(x.q, x.v, a, sign[e]) : 0.0);
        force -= sign[e] * size * k[e];
      }
      a = force / J_q;
      if (std::abs(a - last) <= 4.0 * kEps * std::abs(a)) break;
    }
    return a;
  }
  [[nodiscard]] At Step(const At& x, const std::vector<int>& sign, double h) const {  // RK4
    const auto rates = [&](const At& at) { return At{at.v, Acceleration(at, sign)}; };
    const auto on = [](const At& at, const At& rate, double t) {
      return At{at.q + t * rate.q, at.v + t * rate.v};
    };
    const At a = rates(x), b = rates(on(x, a, h / 2)), c = rates(on(x, b, h / 2)),
             d = rates(on(x, c, h));
    return {x.q + h / 6 * (a.q + 2 * b.q + 2 * c.q + d.q),
            x.v + h / 6 * (a.v + 2 * b.v + 2 * c.v + d.v)};
  }
  // Which way it starts at rest, or 0 if friction that is not by load holds it.
  [[nodiscard]] int Starts(double q) const {
    double most = 0.0;
    for (const Friction& friction : frictions) most += friction.force * std::abs(friction.k(q));
    const double force = -Slope(V, q);
    return std::abs(force) <= most ? 0 : (force > 0.0 ? 1 : -1);
  }
  [[nodiscard]] std::vector<int> Signs(double q, int direction) const {
    std::vector<int> sign;
    for (const Friction& friction : frictions) {
      sign.push_back(friction.k(q + 1e-6 * direction) > 0.0 ? direction : -direction);
    }
    return sign;
  }
  // States at the samples; how often a coordinate passed its dead centre, and all stopped.
  [[nodiscard]] std::vector<At> Follow(At x, const std::vector<double>& times, double step_s,
                                       int* passed, int* stopped) const {
    int direction = x.v == 0.0 ? Starts(x.q) : (x.v > 0.0 ? 1 : -1);
    std::vector<int> sign = Signs(x.q, direction);
    std::vector<At> samples = {x};
    *passed = *stopped = 0;
    for (size_t i = 1; i < times.size(); ++i) {
      const auto steps = static_cast<int>(std::ceil((times[i] - times[i - 1]) / step_s));
      const double h = (times[i] - times[i - 1]) / steps;
      for (int n = 0; n < steps; ++n) {
        for (double left = h; left > 0.0 && direction != 0 && *passed + *stopped < 100;) {
          const auto stops = [&](const At& at) { return direction * at.v < 0.0; };
          const auto over = [&](const At& at) {
            if (stops(at)) return true;
            for (size_t e = 0; e < sign.size(); ++e) {
              if (sign[e] * direction * frictions[e].k(at.q) < 0.0) return true;
            }
            return false;
          };
          const At end = Step(x, sign, left);
          if (!over(end)) {
            x = end;
            break;
          }
          double low = 0.0, high = left;
          for (int k = 0; k < 60; ++k) {
            const double middle = 0.5 * (low + high);
            (over(Step(x, sign, middle)) ? high : low) = middle;
          }
          const bool stop = stops(Step(x, sign, high));
          x = Step(x, sign, high);
          left -= high;
          ++*(stop ? stopped : passed);
          if (stop) {
            x.v = 0.0;
            direction = Starts(x.q);
          }
          sign = Signs(x.q, direction);
        }
      }
      samples.push_back(x);
    }
    return samples;
  }
};

void AddDryFriction(Mechanism* m, int joint, double force) {
  ForceElement dry;
  dry.name = "dry" + std::to_string(m->elements.size());
  dry.joint = joint;
  dry.law = CoulombFriction(force);
  m->elements.push_back(dry);
}

/// The crank-rocker of FourBar with friction in these joints (A, B, D, C) [N m].
OneDof FourBarWithFriction(const std::array<double, 4>& torque, Mechanism* m) {
  *m = MakeFourBar();
  OneDof truth{.J = [](double q) { return FourBar(q).J(); },
               .V = [](double q) { return FourBar(q).V(); },
               .frictions = {}};
  const std::array<OneDof::Function, 4> k = {
      [](double) { return 1.0; }, [](double q) { return FourBar(q).k2() - 1.0; },
      [](double q) { return FourBar(q).k3(); },
      [](double q) { return FourBar(q).k3() - FourBar(q).k2(); }};
  for (size_t j = 0; j < 4; ++j) {
    if (torque.at(j) == 0.0) continue;
    AddDryFriction(m, static_cast<int>(j), torque.at(j));
    truth.frictions.push_back({torque.at(j), k.at(j)});
  }
  return truth;
}

/// A crank about z at the origin that drives one slider along x, or a second one the other way from
/// the opposite pin: both are at their dead centres at the same time. Gravity along −y.
struct Boxer {
  static constexpr double r = 0.06, l = 0.22, g = 9.81;
  static constexpr double m1 = 0.9, I1 = 0.0015, m2 = 0.6, I2 = 0.0024, m3 = 1.4;
  static constexpr double off = 0.02;  ///< of the crank's centre of mass
  int sliders = 1;

  // The first half at crank angle q: rod angle f, sin f = −(r/l) sin q.
  struct Half {
    double f, df, ddf, x, dx, dcx, dcy, cy;
    explicit Half(double q) {
      f = std::asin(-r / l * std::sin(q));
      df = -r * std::cos(q) / (l * std::cos(f));
      ddf = r * std::sin(q) / (l * std::cos(f)) + df * df * std::tan(f);
      x = r * std::cos(q) + l * std::cos(f);
      dx = -r * std::sin(q) - l * std::sin(f) * df;
      dcx = -r * std::sin(q) - l / 2 * std::sin(f) * df;
      dcy = r * std::cos(q) + l / 2 * std::cos(f) * df;
      cy = r * std::sin(q) + l / 2 * std::sin(f);
    }
  };
  static double SliderRate(double q) { return Half(q).dx; }
  // What the first guide bears, from the moments about the pin of a rod whose end pushes its slider
  // with C: l (cos f C_y − sin f C_x) = −I2 f̈ − m2 l/2 (cos f (a_y + g) − sin f a_x).
  static double Load(double q, double v, double a, double gravity, double force, double coefficient,
                     int sign) {
    const Half at(q);
    const double c = std::cos(at.f), s = std::sin(at.f);
    const double turn_s = s * at.ddf + c * at.df * at.df, turn_c = c * at.ddf - s * at.df * at.df;
    const double ddx = -r * std::cos(q) - l * turn_s, dd_cx = ddx + l / 2 * turn_s,
                 dd_cy = -r * std::sin(q) + l / 2 * turn_c;
    const auto second = [&](double first, double twice) { return twice * v * v + first * a; };
    const double inertia =
        I2 * second(at.df, at.ddf) +
        m2 * l / 2 * (c * (second(at.dcy, dd_cy) + gravity) - s * second(at.dcx, dd_cx));
    double load = 0.0;
    for (int pass = 0; pass < 60; ++pass) {
      const double C_x = m3 * second(at.dx, ddx) + sign * (force + coefficient * load);
      const double C_y = (s * C_x - inertia / l) / c, last = load;
      load = std::abs(m3 * gravity - C_y);
      if (std::abs(load - last) <= 4.0 * kEps * load) break;
    }
    return load;
  }

  [[nodiscard]] OneDof Truth() const {
    const double n = sliders;
    return {
        .J =
            [n](double q) {
              const Half at(q);
              return I1 + m1 * off * off +
                     n * (I2 * at.df * at.df + m2 * (at.dcx * at.dcx + at.dcy * at.dcy) +
                          m3 * at.dx * at.dx);
            },
        .V = [n](double q) { return g * (m1 * off * std::sin(q) + (2.0 - n) * m2 * Half(q).cy); },
        .frictions = {}};
  }

  [[nodiscard]] Mechanism Make(double q) const {
    const double f = std::asin(-r / l * std::sin(q));
    Mechanism m;
    m.name = "boxer";
    m.gravity_W = Vec3(0, -g, 0);
    m.bodies = {MakeWorld(), MakeBody("crank", m1, {off, 0, 0}, Vec3::Constant(I1))};
    m.joints = {MakeJoint("A", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}, q)};
    for (int s = 0; s < sliders; ++s) {
      const int rod = 2 + 2 * s, slider = rod + 1;
      const std::string n = std::to_string(s + 1);
      m.bodies.push_back(MakeBody("rod" + n, m2, {l / 2, 0, 0}, Vec3::Constant(I2)));
      m.bodies.push_back(MakeBody("slider" + n, m3, Vec3::Zero(), Vec3::Constant(0.002)));
      m.joints.push_back(MakeJoint("D" + n, JointKind::kPrismatic, 0, Vec3::Zero(), slider,
                                   Vec3::Zero(), Half(q).x));
      m.joints.back().X_PF.linear() = RotZ(s * kPi);
      m.joints.back().axis = Vec3::UnitX();
      const double pin = s == 0 ? r : -r;
      m.joints.push_back(
          MakeJoint("B" + n, JointKind::kRevolute, 1, {pin, 0, 0}, rod, {0, 0, 0}, f - q));
      m.joints.back().X_PF.linear() = RotZ(s * kPi);
      // Every joint bears what statics determines.
      m.joints.push_back(MakeJoint("C" + n, JointKind::kPointOnLine, slider, {0, 0, 0}, rod,
                                   {l, 0, 0}, 0.0, true));
    }
    m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
    AddTree(&m);
    std::vector<std::array<double, 6>> home;
    for (const Joint& joint : m.joints) home.push_back(joint.home);
    m.X_WB_home = TreePoses(m, home);
    return m;
  }
  static int Guide(int s) { return 1 + 3 * s; }
};

// Against its equation of motion the reference's errors of position and rate, over the largest
// rate, and of energy over what friction takes.
struct Followed {
  double position = 0.0, rate = 0.0, energy = 0.0;
  int passed = 0, stopped = 0;
};
Followed Against(const OneDof& truth, const ForwardRun& run, double step_s) {
  EXPECT_TRUE(run.summary.ok()) << run.summary.message << " " << run.summary.time_s;
  Followed off;
  const VecX q = ColumnOf(run.trace, "motor.position"), v = ColumnOf(run.trace, "motor.velocity"),
             taken = ColumnOf(run.trace, "dampers.work"),
             energy = ColumnOf(run.trace, "energy.kinetic") +
                      ColumnOf(run.trace, "energy.gravity") - taken;
  const std::vector<OneDof::At> samples =
      truth.Follow({q[0], v[0]}, run.trace.time_s, step_s, &off.passed, &off.stopped);
  const double fastest = v.cwiseAbs().maxCoeff(), least = taken.minCoeff();
  const auto raise = [](double* most, double by) { *most = by <= *most ? *most : by; };
  for (size_t i = 0; i < samples.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    raise(&off.position, std::abs(q[k] - samples[i].q) / fastest);
    raise(&off.rate, std::abs(v[k] - samples[i].v) / fastest);
    raise(&off.energy, std::abs(energy[k] - energy[0]) / -least);
  }
  return off;
}

struct Start {
  double q, v, duration_s;
  int passes, stops;  ///< at least this many dead centres, and stops of everything
};

// The reference follows the equation of motion, and not that with a thousandth more friction.
void ExpectFollowed(const OneDof& truth, const Mechanism& m, const Start& start) {
  const ForwardRun run = RunForwardReference(m, FreeMotion(m, start.q, start.v, start.duration_s));
  const Followed off = Against(truth, run, 4e-5);
  EXPECT_LT(off.position, kMachine);
  EXPECT_LT(off.rate, kMachine);
  EXPECT_LT(off.energy, kMachine);
  EXPECT_GE(off.passed, start.passes);
  EXPECT_GE(off.stopped, start.stops);
  OneDof more = truth;
  for (OneDof::Friction& friction : more.frictions) {
    friction.force *= 1.001;
    if (!friction.by_load) continue;
    friction.by_load = [load = friction.by_load](double q, double v, double a, int sign) {
      return 1.001 * load(q, v, a, sign);
    };
  }
  EXPECT_GT(Against(more, run, 2e-4).rate, 100.0 * kMachine);
}

// The rocker stops at its dead centres while the crank goes on; nothing holds it there.
TEST(DeadCentre, ACrankRockerWithFrictionInItsJointsFollowsItsEquationOfMotion) {
  const std::array<double, 4> little = {0, 0, 0.01, 0}, much = {0, 0, 0.8, 0},
                              all = {0.02, 0.05, 0.3, 0.15};
  for (const auto& [torque, start] : {std::pair{little, Start{1.0, 0.0, 1.5, 2, 1}},
                                      {little, {1.0, 9.0, 1.0, 2, 0}},
                                      {much, {1.0, 9.0, 1.5, 2, 1}},
                                      {all, {1.0, 9.0, 2.5, 4, 2}}}) {
    SCOPED_TRACE(testing::Message() << torque[0] << " " << torque[2] << " " << start.v);
    Mechanism m;
    const OneDof truth = FourBarWithFriction(torque, &m);
    ExpectFollowed(truth, m, start);
  }
}

// One slider or two that turn at the same time, one friction element in each guide or two; let
// fall, turning, and from a dead centre.
TEST(DeadCentre, SlidersWithFrictionInTheirGuidesFollowTheirEquationOfMotion) {
  const Start fall{1.0, 0.0, 1.2, 0, 1}, turn{1.0, 30.0, 0.4, 3, 0}, rest{0.0, 0.0, 0.8, 0, 1},
      from{0.0, -20.0, 0.5, 1, 0};
  for (const int sliders : {1, 2}) {
    for (const Start& start : {fall, turn, rest, from}) {
      for (const int elements : {1, 2}) {
        SCOPED_TRACE(testing::Message() << sliders << " sliders, " << elements << " elements, from "
                                        << start.q << " " << start.v);
        const Boxer boxer{.sliders = sliders};
        Mechanism m = boxer.Make(start.q);
        OneDof truth = boxer.Truth();
        for (int n = 0; n < sliders * elements; ++n) {
          const double force = 0.15 + 0.05 * n;
          AddDryFriction(&m, Boxer::Guide(n % sliders), force);
          truth.frictions.push_back({force, Boxer::SliderRate});
        }
        ExpectFollowed(truth, m, start);
      }
    }
  }
}

// Guides with friction by what they bear as well: at the dead centre both turn at once, by the
// loads of the motion that goes on.
TEST(DeadCentre, SlidersWithFrictionByTheirLoadsFollowTheirEquationOfMotion) {
  for (const int sliders : {1, 2}) {
    for (const Start& start :
         {Start{1.0, 0.0, 0.9, 0, sliders == 1 ? 1 : 0}, Start{1.0, 14.0, 0.4, 1, 0}}) {
      SCOPED_TRACE(testing::Message() << sliders << " sliders from " << start.v);
      const Boxer boxer{.sliders = sliders};
      Mechanism m = boxer.Make(start.q);
      OneDof truth = boxer.Truth();
      const double force = 0.1, coefficient = 0.03;
      for (int s = 0; s < sliders; ++s) {
        AddDryFriction(&m, Boxer::Guide(s), force);
        std::get<FrictionLaw>(m.elements.back().law).coefficient = coefficient;
        const double g = s == 0 ? Boxer::g : -Boxer::g;
        truth.frictions.push_back(
            {force, Boxer::SliderRate, [=](double q, double v, double a, int sign) {
               return coefficient * Boxer::Load(q, v, a, g, force, coefficient, sign);
             }});
      }
      ExpectFollowed(truth, m, start);
    }
  }
}

// A slider that rests at its dead centre is not held there: it slides as soon as the motor begins
// to turn the crank, however late.
TEST(DeadCentre, ASliderAtRestThereHasFrictionOnceTheMotorTurns) {
  const double force = 0.5;
  Mechanism m = Boxer{}.Make(0.0);
  m.gravity_W.setZero();
  AddDryFriction(&m, Boxer::Guide(0), force);
  Motion motion = FreeMotion(m, 0.0, 0.0, 0.5);
  motion.forces[0].force = {{BumpTerm{.start_s = 0.2, .duration_s = 0.2, .height = 0.1}}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double q = ColumnOf(run.trace, "motor.position").tail<1>()[0];
  ASSERT_GT(q, 0.4);
  ASSERT_LT(q, kPi);
  EXPECT_NEAR(ColumnOf(run.trace, "dampers.work").tail<1>()[0],
              -force * (Boxer::Half(0.0).x - Boxer::Half(q).x), kFollowed);
}

// Random systems, with more elements than DOFs as well: what is found is the least of (2).
TEST(RestDecision, FindsTheLeastOfGauss) {
  std::mt19937_64 random(20261122);
  std::normal_distribution<double> normal;
  const auto matrix = [&](Eigen::Index rows, Eigen::Index cols) {
    return MatX(MatX::NullaryExpr(rows, cols, [&] { return normal(random); }));
  };
  int sticking = 0, starting = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Index dofs = 1 + trial % 4, elements = 1 + trial % 6;
    const MatX L = matrix(dofs, dofs);
    internal::RestSystem system;
    system.H = L * L.transpose() + 0.3 * MatX::Identity(dofs, dofs);
    system.f = 3.0 * matrix(dofs, 1);
    system.G = matrix(elements, dofs);
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
    held.G.resize(0, dofs);
    for (Eigen::Index e = 0; e < elements; ++e) {
      const int s = sign[static_cast<size_t>(e)];
      (s == 0 ? sticking : starting) += 1;
      if (s != 0) {
        held.f -= s * system.most[e] * system.G.row(e).transpose();
        continue;
      }
      held.G.conservativeResize(held.G.rows() + 1, dofs);
      held.G.bottomRows(1) = system.G.row(e);
    }
    held.d = VecX::Zero(held.G.rows());
    const VecX u = internal::HeldMotion(held);
    for (int other = 0; other < 40; ++other) {
      const VecX step = std::pow(10.0, -(other % 5)) * matrix(dofs, 1);
      EXPECT_GE(size(u + step), size(u) - 1e-12) << trial;
    }
  }
  EXPECT_GT(sticking, 100);
  EXPECT_GT(starting, 100);
}

}  // namespace
}  // namespace mbv::fixtures
