// Splines of tables: exact rows are met, noise is taken out, rounds join.
#include "scenario/tables/table_spline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace mbv {
namespace {

constexpr double kTurns = 2 * std::numbers::pi;

// One period of sin(2πt) in steps of h, last row included, with white noise.
SplineRows SineRows(int n, double deviation) {
  std::mt19937_64 random(20260722);
  std::normal_distribution<double> noise(0.0, 1.0);
  SplineRows rows{.deviation = deviation};
  for (int i = 0; i <= n; ++i) {
    const double t = static_cast<double>(i) / n;
    rows.time_s.push_back(t);
    rows.values.push_back(std::sin(kTurns * t) + deviation * noise(random));
  }
  return rows;
}

JetSize ErrorOf(const Piecewise& p, double from_s, double to_s) {
  JetSize size;
  int count = 0;
  for (double t = from_s; t <= to_s; t += 0.0007, ++count) {
    const Jet jet = Evaluate(p, t);
    const double a = jet.acceleration + kTurns * kTurns * std::sin(kTurns * t);
    size.rms.acceleration += a * a;
    size.max.value = std::max(size.max.value, std::abs(jet.value - std::sin(kTurns * t)));
  }
  size.rms.acceleration = std::sqrt(size.rms.acceleration / count);
  return size;
}

TEST(RowSpline, MeetsEveryRow) {
  const SplineRows rows = SineRows(40, 0.0);
  const Piecewise p = Interpolated(rows);
  for (size_t i = 0; i < rows.time_s.size(); ++i) {
    EXPECT_NEAR(Evaluate(p, rows.time_s[i]).value, rows.values[i], 1e-14);
  }
  EXPECT_LT(ErrorOf(p, 0.0, 1.0).max.value, 1e-6);
}

TEST(RowSpline, RatesAreHonoured) {
  SplineRows rows = SineRows(10, 0.0);
  // Not the positions' own derivative: each row's rate is met nevertheless.
  for (const double t : rows.time_s) rows.rates.push_back(1.1 * kTurns * std::cos(kTurns * t));
  const Piecewise p = Interpolated(rows);
  for (size_t i = 0; i < rows.time_s.size(); ++i) {
    EXPECT_NEAR(Evaluate(p, rows.time_s[i]).rate, rows.rates[i], 1e-12);
    EXPECT_NEAR(Evaluate(p, rows.time_s[i]).value, rows.values[i], 1e-14);
  }
}

// The misfit of the smoothing spline is what the noise allows, and its acceleration is far better.
TEST(RowSpline, SmoothingTakesTheNoiseOutAndNoMore) {
  const double deviation = 1e-3;
  SplineRows rows = SineRows(400, deviation);
  rows.stated = true;
  const Piecewise through = Interpolated(rows), smooth = Smoothed(rows);
  double misfit = 0.0;
  for (size_t i = 0; i < rows.time_s.size(); ++i) {
    const double e = (Evaluate(smooth, rows.time_s[i]).value - rows.values[i]) / deviation;
    misfit += e * e;
  }
  EXPECT_NEAR(misfit / static_cast<double>(rows.time_s.size()), 1.0, 1e-6);
  EXPECT_GT(ErrorOf(through, 0.1, 0.9).rms.acceleration, 100.0);  // of an amplitude of 39
  EXPECT_LT(ErrorOf(smooth, 0.1, 0.9).rms.acceleration, 1.0);
  EXPECT_LT(ErrorOf(smooth, 0.0, 1.0).max.value, 2 * deviation);
  // Twice the noise is allowed: it follows less.
  SplineRows more = rows;
  more.deviation = 2 * deviation;
  EXPECT_GT(ErrorOf(Smoothed(more), 0.0, 1.0).max.value, ErrorOf(smooth, 0.0, 1.0).max.value);
}

// Cross-validation finds λ by itself, with a deviation that is wrong by half, however many rows
// there are.
TEST(RowSpline, CrossValidationNeedsNoExactDeviation) {
  for (const int n : {100, 1000, 30000}) {
    SplineRows rows = SineRows(n, 1e-3);
    const double allowed = n < 1000 ? 1.0 : 0.4;  // of an amplitude of 39
    EXPECT_LT(ErrorOf(Smoothed(rows), 0.1, 0.9).rms.acceleration, allowed) << n;
    rows.deviation *= 0.5;
    EXPECT_LT(ErrorOf(Smoothed(rows), 0.1, 0.9).rms.acceleration, allowed) << n;
  }
}

TEST(RowSpline, ExactRowsAreNotSmoothed) {
  const SplineRows rows = SineRows(40, 0.0);
  EXPECT_EQ(DifferenceOf(Smoothed(rows), Interpolated(rows), rows.time_s).max.acceleration, 0.0);
}

TEST(RowSpline, RoundsJoinWithoutAJump) {
  SplineRows rows = SineRows(24, 0.0);
  for (double& value : rows.values) value *= 0.1;
  for (size_t i = 0; i < rows.values.size(); ++i) rows.values[i] += kTurns * rows.time_s[i];
  const Piecewise p = Interpolated(rows, {.periodic = true, .advance = kTurns});
  for (const double seam : {-1.0, 0.0, 1.0, 7.0}) {
    const Jet before = Evaluate(p, seam - 1e-9), after = Evaluate(p, seam + 1e-9);
    EXPECT_NEAR(before.value, after.value, 1e-7);
    EXPECT_NEAR(before.rate, after.rate, 1e-7);
    EXPECT_NEAR(before.acceleration, after.acceleration, 1e-5);
  }
  EXPECT_NEAR(Evaluate(p, 3.25).value - Evaluate(p, 0.25).value, 3 * kTurns, 1e-12);
  EXPECT_NEAR(Evaluate(p, 5.1).acceleration, -0.1 * kTurns * kTurns * std::sin(kTurns * 0.1), 2e-4);
}

TEST(RowSpline, SizesAreRmsAndLargest) {
  const SplineRows rows = SineRows(50, 0.0);
  const JetSize size = SizeOf(Interpolated(rows), rows.time_s);
  EXPECT_NEAR(size.rms.value, std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(size.max.rate, kTurns, 1e-4);
  EXPECT_NEAR(size.rms.acceleration, kTurns * kTurns * std::sqrt(0.5), 1e-2);
}

}  // namespace
}  // namespace mbv
