// Laws of motion: known numbers, derivatives against differences of the values, limits and ends.
#include "math/profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace mbv {
namespace {

using std::numbers::pi;

constexpr double kEpsilon = 1e-13;  // some roundings of numbers of order 1

ProfileTerm Term(const Piecewise& pieces) {
  return PiecewiseTerm{std::make_shared<const Piecewise>(pieces)};
}

struct Largest {
  double rate = 0.0, acceleration = 0.0;
};
Largest LargestOf(const ProfileTerm& term, double end_s) {
  Largest largest;
  constexpr int kSamples = 20000;
  for (int i = 0; i <= kSamples; ++i) {
    const Jet jet = Evaluate(term, end_s * i / kSamples);
    largest.rate = std::max(largest.rate, std::abs(jet.rate));
    largest.acceleration = std::max(largest.acceleration, std::abs(jet.acceleration));
  }
  return largest;
}

// The end of a motion from rest to rest: its last break.
double EndOf(const Piecewise& pieces) { return pieces.breaks.back(); }

// Sixth-order central difference; h is small against every time scale here.
template <typename F>
double SlopeAt(F f, double t) {
  constexpr double h = 1e-4;
  return (45 * (f(t + h) - f(t - h)) - 9 * (f(t + 2 * h) - f(t - 2 * h)) +
          (f(t + 3 * h) - f(t - 3 * h))) /
         (60 * h);
}

// No sample is nearer than 3 h to a break.
bool IsSmoothAt(const std::vector<double>& breaks, double t) {
  return std::all_of(breaks.begin(), breaks.end(),
                     [t](double at) { return std::abs(at - t) > 4e-4; });
}

TEST(MotionLaws, RatesAndAccelerationsAreDerivatives) {
  const ProfileTerm terms[] = {
      Term(Trapezoid(0.1, -0.8, {1.0, 2.0, 0.0})),
      Term(SCurve(0.1, 0.7, {1.0, 2.0, 8.0})),
      Term(Via({0.0, 0.3, 0.5, 1.0, 1.4}, {0.1, -0.2, 0.4, 0.4, 0.0},
               {false, false, true, false, false})),
      ModifiedSineTerm{0.1, 1.2, -0.6},
      Poly4567StepTerm{0.1, 1.2, -0.6},
      FourierTerm{0.2, 0.7, {0.3, -0.1, 0.05}, {0.1, 0.2, -0.04}},
  };
  for (const ProfileTerm& term : terms) {
    const std::vector<double> breaks = BreakTimes(Profile{{term}});
    for (double t = 0.003; t < 1.6; t += 0.0131) {
      if (!IsSmoothAt(breaks, t)) continue;
      const Jet jet = Evaluate(term, t);
      const double rate = SlopeAt([&](double s) { return Evaluate(term, s).value; }, t);
      const double acceleration = SlopeAt([&](double s) { return Evaluate(term, s).rate; }, t);
      EXPECT_NEAR(jet.rate, rate, 1e-10) << "term " << term.index() << " at " << t;
      EXPECT_NEAR(jet.acceleration, acceleration, 1e-8) << "term " << term.index() << " at " << t;
    }
  }
}

TEST(MotionLaws, TrapezoidCruisesWhereThereIsRoom) {
  const Piecewise p = Trapezoid(0.2, 1.0, {1.0, 2.0, 0.0});
  EXPECT_NEAR(EndOf(p), 0.2 + 1.5, kEpsilon);  // 0.5 s up, 0.5 s at 1 m/s, 0.5 s down
  EXPECT_NEAR(Evaluate(p, 0.7).value, 0.25, kEpsilon);
  EXPECT_NEAR(Evaluate(p, 0.95).rate, 1.0, kEpsilon);
  EXPECT_NEAR(Evaluate(p, 0.95).acceleration, 0.0, kEpsilon);
  EXPECT_NEAR(Evaluate(p, 1.5).acceleration, -2.0, kEpsilon);
  EXPECT_EQ(Evaluate(p, 0.1).value, 0.0);
  EXPECT_EQ(Evaluate(p, 9.0).value, 1.0);
  EXPECT_EQ(Evaluate(p, 9.0).rate, 0.0);
  ASSERT_EQ(p.breaks.size(), 4u);
  EXPECT_NEAR(p.breaks[1], 0.7, kEpsilon);
  EXPECT_NEAR(p.breaks[2], 1.2, kEpsilon);
}

TEST(MotionLaws, TrapezoidIsATriangleWhereSpeedIsNotReached) {
  const Piecewise p = Trapezoid(0.0, -0.5, {2.0, 2.0, 0.0});
  EXPECT_NEAR(EndOf(p), 1.0, kEpsilon);
  EXPECT_NEAR(Evaluate(p, 0.5).value, -0.25, kEpsilon);
  EXPECT_NEAR(LargestOf(Term(p), 1.0).rate, 1.0, 1e-9);
  EXPECT_EQ(p.breaks.size(), 3u);
}

// By hand from [Biagiotti 2008, §3.4]: which limit is reached makes four cases.
TEST(MotionLaws, SCurveKnowsWhichLimitsItReaches) {
  struct Case {
    double delta;
    MotionLimits limits;
    double end_s, rate, acceleration;
    size_t breaks;
  };
  const Case cases[] = {
      // T_j = 2/8, T_a = 1/4 + 1/2, T_v = 1 − 3/4
      {1.0, {1.0, 2.0, 8.0}, 1.75, 1.0, 2.0, 8},
      // a_max is not reached: T_j = √(1/4), a = 4/2, T_a = 1, T_v = 1
      {-2.0, {1.0, 10.0, 4.0}, 3.0, 1.0, 2.0, 6},
      // v_max is not reached: T_a = 1/8 + √(1/64 + 1/2), v = 2 (T_a − 1/4)
      {1.0,
       {10.0, 2.0, 8.0},
       2 * (0.125 + std::sqrt(0.515625)),
       2 * (std::sqrt(0.515625) - 0.125),
       2.0,
       7},
      // Neither: T_j = ∛(1/128), a = 8 T_j, v = 8 T_j²
      {0.125,
       {10.0, 20.0, 8.0},
       4 * std::cbrt(1 / 128.),
       8 * std::pow(1 / 128., 2 / 3.),
       8 * std::cbrt(1 / 128.),
       5},
  };
  for (const Case& c : cases) {
    const Piecewise p = SCurve(0.0, c.delta, c.limits);
    EXPECT_NEAR(EndOf(p), c.end_s, kEpsilon) << c.delta;
    const Largest largest = LargestOf(Term(p), c.end_s);
    EXPECT_NEAR(largest.rate, c.rate, 1e-6) << c.delta;
    EXPECT_NEAR(largest.acceleration, c.acceleration, 1e-3) << c.delta;
    EXPECT_LE(largest.rate, c.rate * (1 + kEpsilon)) << c.delta;
    EXPECT_LE(largest.acceleration, c.acceleration * (1 + kEpsilon)) << c.delta;
    EXPECT_EQ(p.breaks.size(), c.breaks) << c.delta;
    // What its last phase comes to before the end is held.
    EXPECT_NEAR(Evaluate(p, EndOf(p) * (1 - 1e-9)).value, c.delta, 1e-12);
    EXPECT_EQ(Evaluate(p, EndOf(p) + 1.0).value, c.delta);
  }
  EXPECT_NEAR(Evaluate(SCurve(0.0, 1.0, {1.0, 2.0, 8.0}), 0.25).value, 8 * std::pow(0.25, 3) / 6,
              kEpsilon);
}

// Peaks of the modified sine from tables of cam laws: 1.760 and 5.528.
TEST(MotionLaws, ModifiedSineHasItsKnownPeaks) {
  const ProfileTerm term = ModifiedSineTerm{0.0, 1.0, 1.0};
  const Largest largest = LargestOf(term, 1.0);
  EXPECT_NEAR(largest.rate, 4 * pi / (4 + pi), 1e-12);
  EXPECT_NEAR(largest.rate, 1.760, 5e-4);
  EXPECT_NEAR(largest.acceleration, 5.528, 5e-4);
  EXPECT_NEAR(Evaluate(term, 0.125).value, (pi / 8 - 0.25) / (4 + pi), 1e-15);
  // The pieces join: value, rate and acceleration.
  for (const double t : {0.125, 0.875, 1.0}) {
    const Jet before = Evaluate(term, t - 1e-12), after = Evaluate(term, t + 1e-12);
    EXPECT_NEAR(before.value, after.value, 1e-11) << t;
    EXPECT_NEAR(before.rate, after.rate, 1e-10) << t;
    EXPECT_NEAR(before.acceleration, after.acceleration, 1e-9) << t;
  }
  EXPECT_EQ(Evaluate(term, 2.0).value, 1.0);
}

// Peaks of the 4-5-6-7 polynomial from tables of cam laws: 2.1875 and 7.5132.
TEST(MotionLaws, Poly4567HasItsKnownPeaksAndStartsWithoutJerk) {
  const ProfileTerm term = Poly4567StepTerm{0.0, 1.0, 1.0};
  const Largest largest = LargestOf(term, 1.0);
  EXPECT_NEAR(largest.rate, 2.1875, 1e-12);
  EXPECT_NEAR(largest.acceleration, 84.0 / (5.0 * std::sqrt(5.0)), 1e-4);
  EXPECT_NEAR(Evaluate(term, 0.25).value, (35 - 84 / 4. + 70 / 16. - 20 / 64.) / 256, 1e-15);
  EXPECT_NEAR(Evaluate(term, 1.0 - 1e-12).value, 1.0, 1e-15);
  EXPECT_EQ(Evaluate(term, 2.0).value, 1.0);
  // An acceleration that begins as t² has no jerk at the ends: 420 t² there.
  EXPECT_NEAR(Evaluate(term, 1e-4).acceleration, 420e-8, 2e-9);
  EXPECT_NEAR(Evaluate(term, 1 - 1e-4).acceleration, -420e-8, 2e-9);
}

TEST(MotionLaws, FourierGivesAmplitudesOfTheRate) {
  const ProfileTerm term = FourierTerm{0.3, 0.5, {2.0, 0.0}, {0.0, 1.0}};
  // q = 0.3 + 2/π sin πt − 1/2π cos 2πt
  for (const double t : {0.0, 0.1, 0.7, 3.3}) {
    const Jet jet = Evaluate(term, t);
    EXPECT_NEAR(jet.value, 0.3 + 2 / pi * std::sin(pi * t) - std::cos(2 * pi * t) / (2 * pi),
                kEpsilon);
    EXPECT_NEAR(jet.rate, 2 * std::cos(pi * t) + std::sin(2 * pi * t), kEpsilon);
    EXPECT_NEAR(jet.acceleration, -2 * pi * std::sin(pi * t) + 2 * pi * std::cos(2 * pi * t),
                1e-12);
  }
}

TEST(MotionLaws, ViaRestsWhereItIsReportedAndIsSmoothElsewhere) {
  const std::vector<double> times = {0.0, 0.3, 0.5, 1.0, 1.4}, values = {0.1, -0.2, 0.4, 0.4, 0.0};
  const Piecewise p = Via(times, values, {false, false, true, false, false});
  for (size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(Evaluate(p, times[i]).value, values[i], kEpsilon);
    const bool rests = i == 0 || i == 2 || i == 4;
    EXPECT_EQ(std::abs(Evaluate(p, times[i]).rate) < 1e-12, rests) << i;
    EXPECT_EQ(std::abs(Evaluate(p, times[i]).acceleration) < 1e-10, rests) << i;
  }
  EXPECT_EQ(p.breaks, (std::vector<double>{0.0, 0.5, 1.4}));
  EXPECT_NEAR(Evaluate(p, 2.0).value, 0.0, kEpsilon);
  EXPECT_EQ(Evaluate(p, 2.0).rate, 0.0);
}

// Between two rests there is one quintic polynomial: the 3-4-5 law.
TEST(MotionLaws, ViaWithRestEverywhereIsPoly345) {
  const Piecewise p = Via({0.2, 1.0, 1.5}, {0.0, 0.7, 0.2}, {true, true, true});
  const ProfileTerm up = PolyStepTerm{0.2, 0.8, 0.7}, down = PolyStepTerm{1.0, 0.5, -0.5};
  for (const double t : {0.25, 0.6, 1.1, 1.3}) {
    const Jet a = Evaluate(p, t), u = Evaluate(up, t), d = Evaluate(down, t);
    EXPECT_NEAR(a.value, u.value + d.value, kEpsilon) << t;
    EXPECT_NEAR(a.acceleration, u.acceleration + d.acceleration, 1e-11) << t;
  }
}

}  // namespace
}  // namespace mbv
