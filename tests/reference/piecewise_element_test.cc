// Stops and characteristic curves in the reference's free motion, against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "reference/forward.h"
#include "tests/mechanisms/stacked_blocks.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

constexpr double kBlockMass = 2.0, kStiffness = 800.0, kGap = 0.2, kSpeed = 1.5;
constexpr double kTracked = 1e-10;  // what steps of tolerance 1e-12 leave, corners included

template <typename Law>
Mechanism BlockOn(const Law& law) {
  Mechanism m = StackedBlocks{{kBlockMass}, {CoulombFriction(0.0)}}.Make();
  m.elements[0].law = law;
  return m;
}

ForwardRun Free(const Mechanism& m, double v0 = kSpeed, double duration_s = 0.6) {
  ForwardRun run = RunForwardReference(m, StackedBlocks::From(m, 0.0, v0, duration_s));
  EXPECT_TRUE(run.summary.ok()) << run.summary.message;
  return run;
}

// Flies to the stop, swings half a period there and flies back.
double ThereAndBack(double t) {
  const double omega = std::sqrt(kStiffness / kBlockMass), meets = kGap / kSpeed;
  const double leaves = meets + std::numbers::pi / omega;
  if (t < meets) return kSpeed * t;
  if (t < leaves) return kGap + kSpeed / omega * std::sin(omega * (t - meets));
  return kGap - kSpeed * (t - leaves);
}

double FarthestFrom(const ForwardRun& run, const std::function<double(double)>& x) {
  const VecX column = ColumnOf(run.trace, "motor1.position");
  double error = 0.0;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    error =
        std::max(error, std::abs(column[static_cast<Eigen::Index>(i)] - x(run.trace.time_s[i])));
  }
  return error;
}

TEST(PiecewiseElements, AStopReturnsWhatMeetsIt) {
  EXPECT_LT(
      FarthestFrom(Free(BlockOn(StopLaw{.upper = kGap, .stiffness = kStiffness})), ThereAndBack),
      kTracked);
  const StopLaw below{.lower = -kGap, .stiffness = kStiffness};
  EXPECT_LT(FarthestFrom(Free(BlockOn(below), -kSpeed), [](double t) { return -ThereAndBack(t); }),
            kTracked);
  EXPECT_GT(
      FarthestFrom(Free(BlockOn(StopLaw{.upper = kGap, .stiffness = kStiffness * (1 + 1e-6)})),
                   ThereAndBack),
      1e-8);
}

TEST(PiecewiseElements, ACurveOfThatStopIsThatStop) {
  const double k = kStiffness;
  const CurveLaw curve{.knots = {{kGap, 0.0, 0.0, -k}, {kGap + 0.01, -0.01 * k, -k, -k}}};
  EXPECT_LT(FarthestFrom(Free(BlockOn(curve)), ThereAndBack), kTracked);
}

// m ∫ v/(1 + a v) dv = −∫ k δⁿ dδ while they touch [Hunt, Crossley 1975].
TEST(PiecewiseElements, AStopWithDissipationKeepsItsIntegral) {
  for (const double n : {1.0, 1.5, 2.2}) {
    const StopLaw law{.upper = kGap, .stiffness = 4e3, .exponent = n, .dissipation = 0.3};
    const double a = law.dissipation;
    const auto integral = [&](double x, double v) {
      const double depth = std::max(0.0, x - kGap);
      return kBlockMass * (v / a - std::log1p(a * v) / (a * a)) +
             law.stiffness * std::pow(depth, n + 1.0) / (n + 1.0);
    };
    const ForwardRun run = Free(BlockOn(law));
    const VecX x = ColumnOf(run.trace, "motor1.position"),
               v = ColumnOf(run.trace, "motor1.velocity");
    const double start = integral(0.0, kSpeed);
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      EXPECT_NEAR(integral(x[i], v[i]), start, kTracked * start) << n << ", " << i;
    }
    EXPECT_LT(v.tail<1>()[0], -0.5);           // it has come back, …
    EXPECT_GT(v.tail<1>()[0], -kSpeed + 0.1);  // … with less
    const VecX balance = ColumnOf(run.trace, "energy.kinetic") +
                         ColumnOf(run.trace, "energy.springs") -
                         ColumnOf(run.trace, "dampers.work");
    EXPECT_LT((balance.array() - balance[0]).abs().maxCoeff(), kTracked * balance[0]) << n;
  }
}

// Fourth-order steps, so short that corners inside them do not count.
TEST(PiecewiseElements, AStopWithADamperNeitherPullsNorDoublesItsForce) {
  const StopLaw law{.upper = kGap, .stiffness = kStiffness, .damping = 60.0};
  const auto acceleration = [&](double x, double v) {
    const double e = kStiffness * std::max(0.0, x - kGap);
    return -(e + std::clamp(law.damping * v, -e, e)) / kBlockMass;
  };
  const ForwardRun run = Free(BlockOn(law));
  const VecX x = ColumnOf(run.trace, "motor1.position");
  double q = 0.0, v = kSpeed;
  constexpr int kPerSample = 5000;
  const double h = 0.01 / kPerSample;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(x[i], q, 1e-9) << i;
    for (int s = 0; s < kPerSample; ++s) {
      const double a1 = acceleration(q, v), v2 = v + 0.5 * h * a1;
      const double a2 = acceleration(q + 0.5 * h * v, v2), v3 = v + 0.5 * h * a2;
      const double a3 = acceleration(q + 0.5 * h * v2, v3), v4 = v + h * a3;
      const double a4 = acceleration(q + h * v3, v4);
      q += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
      v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
  }
  EXPECT_LT(ColumnOf(run.trace, "dampers.work").tail<1>()[0], -0.1);
}

// Curves at three rates that are −k x − c v, and an expression of it, against the damped swing.
TEST(PiecewiseElements, CurvesAtRatesAndExpressionsAreTheSpringAndDamperThatTheyDescribe) {
  const double k = kStiffness, c = 8.0, decay = c / (2.0 * kBlockMass);
  const double w = std::sqrt(k / kBlockMass - decay * decay);
  const auto swing = [&](double t) { return kSpeed / w * std::exp(-decay * t) * std::sin(w * t); };
  const auto curves = [&](double damping) {
    CurvesLaw law{.rates = {-2.0, 0.5, 3.0}, .curves = {}};
    for (const double rate : law.rates) {
      law.curves.push_back({.knots = {{-0.05, 0.05 * k - damping * rate, -k, -k},
                                      {0.02, -0.02 * k - damping * rate, -k, -k}}});
    }
    return law;
  };
  const auto expression = [&](double damping) {
    return ExpressionLaw{.text = "-k*x - c*v",
                         .force = [=](double x, double v) { return -k * x - damping * v; }};
  };
  EXPECT_LT(FarthestFrom(Free(BlockOn(curves(c))), swing), kTracked);
  EXPECT_LT(FarthestFrom(Free(BlockOn(expression(c))), swing), kTracked);
  EXPECT_GT(FarthestFrom(Free(BlockOn(curves(c * (1 + 1e-6)))), swing), 1e-9);
  EXPECT_GT(FarthestFrom(Free(BlockOn(expression(c * (1 + 1e-6)))), swing), 1e-9);
  const ForwardRun run = Free(BlockOn(curves(c)));
  const VecX balance = ColumnOf(run.trace, "energy.kinetic") - ColumnOf(run.trace, "dampers.work");
  EXPECT_LT((balance.array() - balance[0]).abs().maxCoeff(), kTracked * balance[0]);
}

// Force and acceleration jump; events have the closed form's times.
TEST(PiecewiseElements, AnExpressionThatJumpsIsFollowedAcross) {
  const JumpingForce law;
  const auto position = [&](double t) { return law.Position(t); };
  const ForwardRun run = Free(BlockOn(law.Law()));
  EXPECT_LT(FarthestFrom(run, position), 1e-12);
  ASSERT_EQ(run.trace.events.size(), 2u);
  EXPECT_EQ(run.trace.events[0].what, Happening::kBranch);
  EXPECT_NEAR(run.trace.events[0].time_s, law.passes(), 1e-11);
  EXPECT_NEAR(run.trace.events[1].time_s, law.returns(), 1e-11);
  const VecX balance = ColumnOf(run.trace, "energy.kinetic") - ColumnOf(run.trace, "dampers.work");
  EXPECT_LT((balance.array() - balance[0]).abs().maxCoeff(), 1e-11 * balance[0]);
  const JumpingForce wrong{.beyond = law.beyond * (1 + 1e-7)};
  EXPECT_GT(FarthestFrom(Free(BlockOn(wrong.Law())), position), 1e-9);
}

TEST(PiecewiseElements, AnExpressionWithoutValueEndsTheRunByItsName) {
  const ExpressionLaw law{.text = "sqrt(0.1 - x)",
                          .force = [](double x, double) { return std::sqrt(0.1 - x); }};
  Mechanism m = BlockOn(law);
  const ForwardRun run = RunForwardReference(m, StackedBlocks::From(m, 0.0, kSpeed, 0.6));
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported);
  EXPECT_EQ(run.summary.where, m.elements[0].name);
  EXPECT_NE(run.summary.message.find("is not a number"), std::string::npos) << run.summary.message;
}

TEST(RigidStops, ABlockBouncesAsItsClosedFormAndRests) {
  const BouncingBlock block;
  const Mechanism m = block.Make();
  const auto position = [&](double t) { return block.Position(t); };
  ForwardRun run = RunForwardReference(m, BouncingBlock::Thrown(m, 1.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_LT(FarthestFrom(run, position), 1e-12);
  const double energy = 0.5 * block.mass * block.v0 * block.v0;
  EXPECT_NEAR(ColumnOf(run.trace, "dampers.work").tail<1>()[0], -energy, 1e-12 * energy);
  const std::vector<MotionEvent>& events = run.trace.events;
  ASSERT_GT(events.size(), 10u);
  EXPECT_EQ(events[0].what, Happening::kHitsLower);
  EXPECT_NEAR(events[0].time_s, 0.3, 1e-14);
  EXPECT_NEAR(events[1].time_s, 0.3 + 0.18, 1e-13);
  EXPECT_EQ(events.back().what, Happening::kLowerEnd);
  EXPECT_NEAR(events.back().time_s, block.rest_s(), 1e-6);
  const Mechanism wrong = BouncingBlock{.restitution = 0.6 * (1 + 1e-6)}.Make();
  run = RunForwardReference(wrong, BouncingBlock::Thrown(wrong, 1.0));
  EXPECT_GT(FarthestFrom(run, position), 1e-8);
}

TEST(RigidStops, NothingIsLostWhereNothingIs) {
  const BouncingBlock block{.restitution = 1.0};
  const Mechanism m = block.Make();
  const ForwardRun run = RunForwardReference(m, BouncingBlock::Thrown(m, 1.0));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const double t = std::fmod(run.trace.time_s[i], 0.3);
    if (std::min(t, 0.3 - t) < 1e-9) continue;
    EXPECT_NEAR(ColumnOf(run.trace, "motor1.position")[static_cast<Eigen::Index>(i)],
                1.5 * t - 5.0 * t * t, 1e-12);
  }
}

TEST(RigidStops, WhatLeansLeavesWhereItWouldBePulled) {
  const RatchetedBlock ratchet;
  Mechanism m = ratchet.Make();
  m.elements[0].law = StopLaw{.lower = 0.0, .restitution = 0.0};
  const double duration_s = ratchet.start() + ratchet.moves();
  const ForwardRun run = RunForwardReference(m, ratchet.Pushed(m, duration_s));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double error = FarthestFrom(
      run, [&](double t) { return t < ratchet.start() ? 0.0 : ratchet.Way(t - ratchet.start()); });
  EXPECT_LT(error, 1e-12);
  ASSERT_EQ(run.trace.events.size(), 2u);
  EXPECT_EQ(run.trace.events[1].what, Happening::kFree);
  EXPECT_NEAR(run.trace.events[1].time_s, ratchet.start(), 1e-9);
}

TEST(RigidStops, AStartBeyondAnEndIsNamed) {
  const Mechanism m = BouncingBlock().Make();
  const ForwardRun run = RunForwardReference(m, StackedBlocks::From(m, -1e-3, 0.0, 0.1));
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported);
  EXPECT_EQ(run.summary.where, m.elements[0].name);
}

TEST(PiecewiseElements, PiecesChangeAtCorners) {
  const ForceElement stop{
      .name = "s",
      .joint = 0,
      .law = StopLaw{.lower = -1.0, .upper = 1.0, .stiffness = 2.0, .damping = 1.0}};
  const std::vector<std::pair<double, double>> states = {{0.0, 5.0},  {1.5, 0.5},  {1.5, 2.0},
                                                         {1.5, -2.0}, {-1.5, 0.0}, {-1.5, -2.0}};
  std::set<int> pieces;
  for (const auto& [q, v] : states) pieces.insert(PieceOf(stop, q, v));
  EXPECT_EQ(pieces.size(), states.size());
  EXPECT_EQ(PieceOf(stop, 0.9, -3.0), PieceOf(stop, -0.9, 3.0));
  const ForceElement smooth{.name = "c",
                            .joint = 0,
                            .law = CurveLaw{.knots = {{0.0, 0.0, 1.0, 1.0}, {1.0, 2.0, 3.0, 3.0}}}};
  EXPECT_FALSE(HasCorners(smooth));
  EXPECT_TRUE(HasCorners(stop));
}

}  // namespace
}  // namespace mbv::fixtures
