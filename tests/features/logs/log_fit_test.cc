// The fit of a logged force: each term is found with its number, and its standard error is honest.
#include "features/logs/log_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "math/quintic_spline.h"

namespace mbv {
namespace {

using Kind = LogTerm::Kind;

constexpr double kStep = 0.004, kEnd = 8.0;

// A spline through samples.
template <typename F>
Piecewise SplineOf(const F& f) {
  std::vector<double> times;
  std::vector<SplineDatum> data;
  for (int i = 0; i * kStep <= kEnd + 1e-9; ++i) {
    times.push_back(i * kStep);
    data.push_back({i * kStep, f(i * kStep), 0, 1.0});
  }
  return FitSpline(FreeKnots(times, false), data);
}

// A drive that swings with two frequencies and carries a weight and an inertia.
double Position(double t) { return 0.6 * std::sin(2.1 * t) + 0.2 * std::sin(5.3 * t + 0.4); }
double Velocity(double t) { return 1.26 * std::cos(2.1 * t) + 1.06 * std::cos(5.3 * t + 0.4); }
double Acceleration(double t) {
  return -2.646 * std::sin(2.1 * t) - 5.618 * std::sin(5.3 * t + 0.4);
}
double ModelForce(double t) {
  return 7.0 * std::sin(Position(t) + 0.5) + 0.8 * Acceleration(t) +
         0.3 * Velocity(t) * Velocity(t);
}

// What a log does to the model's force.
struct Change {
  double gain = 1.0, offset = 0.0, delay_s = 0.0, coulomb = 0.0, viscous = 0.0, inertia = 0.0;

  [[nodiscard]] double value(Kind kind) const {
    const double values[] = {gain, offset, delay_s, coulomb, viscous, inertia};
    return values[static_cast<size_t>(kind)];
  }
};

class LogFitTest : public testing::Test {
 protected:
  // Noise with the correlation `memory` from row to row.
  [[nodiscard]] LogFit Fit(const Change& change, double noise = 0.0, double memory = 0.0,
                           unsigned seed = 1) const {
    std::mt19937_64 random(20261128 + seed);
    std::normal_distribution<double> normal(0.0, 1.0);
    LogForce force{
        .time_s = {}, .log = {}, .model = &model_, .velocity = &velocity_, .end_s = kEnd};
    double e = 0.0;
    for (int i = 0; i * kStep <= kEnd + 1e-9; ++i) {
      const double t = i * kStep, s = t - change.delay_s;
      e = memory * e + std::sqrt(1.0 - memory * memory) * normal(random);
      force.time_s.push_back(t);
      force.log.push_back(change.gain * ModelForce(s) + change.offset +
                          change.coulomb * (Velocity(s) > 0 ? 1.0 : -1.0) +
                          change.viscous * Velocity(s) + change.inertia * Acceleration(s) +
                          noise * e);
    }
    return FitLogForce(force, 0.05);
  }

  const Piecewise model_ = SplineOf(ModelForce), velocity_ = SplineOf(Velocity);
};

// Where nothing differs nothing is named; each term alone is named alone, with its number.
TEST_F(LogFitTest, NamesWhatDiffersAndNothingElse) {
  EXPECT_LT(Fit({}).share(), 1e-9);
  for (const LogTerm& term : Fit({}).terms) EXPECT_FALSE(term.named) << term.word();
  const Change changes[] = {{.gain = 1.02},     {.offset = -0.4}, {.delay_s = kStep},
                            {.coulomb = 0.5},   {.viscous = 0.3}, {.inertia = 0.05},
                            {.delay_s = -0.011}};
  for (const Change& change : changes) {
    const LogFit fit = Fit(change);
    const Change none;
    for (const LogTerm& term : fit.terms) {
      ASSERT_TRUE(term.fitted) << term.word();
      EXPECT_NEAR(term.value, change.value(term.kind), 2e-6) << term.word();
      EXPECT_EQ(term.named, change.value(term.kind) != none.value(term.kind)) << term.word();
    }
    EXPECT_LT(fit.rms_left, 1e-4 * fit.rms_log);
    EXPECT_GT(fit.share(), 1e-3);
  }
}

TEST_F(LogFitTest, TellsAllTermsTogetherFromEachOther) {
  const Change change{.gain = 1.02,
                      .offset = 0.3,
                      .delay_s = kStep,
                      .coulomb = 0.5,
                      .viscous = 0.1,
                      .inertia = 0.03};
  const LogFit exact = Fit(change), noisy = Fit(change, 0.1);
  for (size_t k = 0; k < exact.terms.size(); ++k) {
    const double truth = change.value(static_cast<Kind>(k));
    EXPECT_NEAR(exact.terms[k].value, truth, 1e-5) << exact.terms[k].word();
    EXPECT_NEAR(noisy.terms[k].value, truth, 4.0 * noisy.terms[k].error) << noisy.terms[k].word();
    EXPECT_GT(noisy.terms[k].error, 0.0);
  }
  EXPECT_NEAR(noisy.rms_left, 0.1, 0.01);
}

// Of 60 logs with noise that remembers 20 rows, 2 standard errors hold the truth in most; those
// that count rows as independent would in a third.
TEST_F(LogFitTest, StandardErrorsHoldWhereNoiseIsCorrelated) {
  int inside = 0, all = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    const LogFit fit = Fit({}, 0.3, 0.95, seed);
    const Change none;
    for (const LogTerm& term : fit.terms) {
      inside += std::abs(term.value - none.value(term.kind)) < 2.0 * term.error ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(inside, 0.8 * all) << inside << " of " << all;
}

TEST_F(LogFitTest, TheOtherSignIsAGain) {
  const LogFit fit = Fit({.gain = -1.0});
  EXPECT_NEAR(fit.term(Kind::kGain).value, -1.0, 1e-6);
  EXPECT_TRUE(fit.term(Kind::kGain).named);
}

// A drive that carries nothing but an inertia: gain and inertia are one thing.
TEST_F(LogFitTest, LeavesOutWhatTheMotionDoesNotTell) {
  const Piecewise inertial = SplineOf([](double t) { return 0.8 * Acceleration(t); });
  LogForce force{
      .time_s = {}, .log = {}, .model = &inertial, .velocity = &velocity_, .end_s = kEnd};
  for (int i = 0; i * kStep <= kEnd + 1e-9; ++i) {
    force.time_s.push_back(i * kStep);
    force.log.push_back(0.88 * Acceleration(i * kStep));
  }
  const LogFit fit = FitLogForce(force, 0.05);
  EXPECT_TRUE(fit.term(Kind::kGain).fitted);
  EXPECT_NEAR(fit.term(Kind::kGain).value, 1.1, 1e-6);
  EXPECT_FALSE(fit.term(Kind::kInertia).fitted);
  // What holds still is so by its size: a way of a micron is one of a robot of a millimetre.
  const Piecewise tiny = SplineOf([](double t) { return 1e-7 * Velocity(t); });
  double fastest = 0.0;
  for (int i = 0; i * kStep <= kEnd + 1e-9; ++i) {
    fastest = std::max(fastest, 1e-7 * std::abs(Velocity(i * kStep)));
  }
  LogForce small = force;
  small.velocity = &tiny;
  for (const double more : {0.5, 2.0}) {
    small.size = more * fastest * kEnd / 1e-6;
    EXPECT_EQ(FitLogForce(small, 0.05).term(Kind::kViscous).fitted, more < 1.0) << more;
  }
  // Nothing moves: friction, delay and inertia say nothing.
  const Piecewise still = SplineOf([](double) { return 0.0; });
  const Piecewise weight = SplineOf([](double) { return 3.0; });
  force.model = &weight;
  force.velocity = &still;
  for (double& value : force.log) value = 3.3;
  const LogFit resting = FitLogForce(force, 0.05);
  EXPECT_NEAR(resting.bias, 0.3, 1e-12);
  for (const Kind kind : {Kind::kDelay, Kind::kCoulomb, Kind::kViscous, Kind::kInertia}) {
    EXPECT_FALSE(resting.term(kind).fitted) << resting.term(kind).word();
  }
}

}  // namespace
}  // namespace mbv
