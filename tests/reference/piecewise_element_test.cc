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
