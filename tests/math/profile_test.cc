// Profiles: hand-checkable values, and derivatives against differences of the value itself.
#include "math/profile.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

const ProfileTerm kTerms[] = {
    ConstantTerm{1.5},
    RampTerm{-0.3},
    SineTerm{0.1, 0.25, 0.4},
    PolyStepTerm{0.2, 0.9, 0.7},
    CycloidStepTerm{0.1, 1.1, -0.4},
    BumpTerm{0.1, 1.2, 0.06},
    RampCruiseTerm{0.05, 0.24, 0.75, 10.0, 0.24},
    RampCruiseTerm{0.05, 0.06, 0.75, 10.0, -0.06},
};

// Sixth-order central difference; h is small against every time scale above (>= 0.18 s).
template <typename F>
double Difference(F f, double t) {
  constexpr double h = 1e-3;
  return (45 * (f(t + h) - f(t - h)) - 9 * (f(t + 2 * h) - f(t - 2 * h)) +
          (f(t + 3 * h) - f(t - 3 * h))) /
         (60 * h);
}

TEST(Profile, RatesAreDerivativesOfValues) {
  for (const ProfileTerm& term : kTerms) {
    // Off the joints of the pieces, where only the third derivative jumps.
    for (double t : {0.0815, 0.2215, 0.2571, 0.3415, 0.6, 0.777}) {
      const Jet jet = Evaluate(term, t);
      const double rate = Difference([&](double s) { return Evaluate(term, s).value; }, t);
      const double acceleration = Difference([&](double s) { return Evaluate(term, s).rate; }, t);
      EXPECT_NEAR(jet.rate, rate, 1e-9) << "term " << term.index() << " at " << t;
      EXPECT_NEAR(jet.acceleration, acceleration, 1e-8) << "term " << term.index() << " at " << t;
    }
  }
}

TEST(Profile, RampCruiseReachesItsLimitsAndItsEnd) {
  const RampCruiseTerm cruise{0.0, 0.24, 0.75, 10.0, 0.24};
  EXPECT_NEAR(Duration(cruise), 0.427772050, 1e-9);  // the tripod's default path
  EXPECT_DOUBLE_EQ(Evaluate(cruise, 0.2).rate, 0.75);
  EXPECT_NEAR(Evaluate(cruise, 1.0).value, 0.24, 1e-15);
  const RampCruiseTerm pure{0.0, 0.06, 0.75, 10.0, 0.06};
  EXPECT_NEAR(Duration(pure), 0.186120972, 1e-9);
  EXPECT_NEAR(Evaluate(pure, 0.5 * Duration(pure)).rate, 0.604446, 1e-6);
}

TEST(Profile, BreakTimesAreTheEndsOfItsPieces) {
  const Profile sum{{RampCruiseTerm{0.1, 0.24, 0.75, 10.0, 0.24}, PolyStepTerm{0.1, 0.5, 1.0},
                     SineTerm{1.0, 1.0, 0.0}}};
  const std::vector<double> times = BreakTimes(sum);
  ASSERT_EQ(times.size(), 5u);
  EXPECT_DOUBLE_EQ(times[0], 0.1);
  EXPECT_NEAR(times[3], 0.1 + Duration(RampCruiseTerm{0.1, 0.24, 0.75, 10.0, 0.24}), 1e-15);
  EXPECT_DOUBLE_EQ(times[4], 0.6);
  // Ramp and cruise join where the speed limit is reached.
  EXPECT_NEAR(Evaluate(sum.terms[0], times[1]).rate, 0.75, 1e-12);
  EXPECT_NEAR(Evaluate(sum.terms[0], times[2]).rate, 0.75, 1e-12);
}

TEST(Profile, SumAddsItsTerms) {
  const Profile sum{{ConstantTerm{1.0}, RampTerm{2.0}}};
  const Jet jet = Evaluate(sum, 3.0);
  EXPECT_DOUBLE_EQ(jet.value, 7.0);
  EXPECT_DOUBLE_EQ(jet.rate, 2.0);
  EXPECT_DOUBLE_EQ(jet.acceleration, 0.0);
}

}  // namespace
}  // namespace mbv
