// Quintic splines: what they reproduce, how they converge, how smooth they are.
#include "math/quintic_spline.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "base/types.h"

namespace mbv {
namespace {

std::vector<double> UnevenTimes(int n, double end_s) {
  std::vector<double> times;
  for (int i = 0; i < n; ++i) {
    const double s = static_cast<double>(i) / (n - 1);
    times.push_back(end_s * (s + 0.1 * s * (1 - s)));
  }
  return times;
}

template <typename F>
Piecewise Through(const std::vector<double>& times, const F& f, bool with_rates) {
  std::vector<SplineDatum> data;
  for (const double t : times) {
    data.push_back({t, f(t).value, 0, 1.0});
    if (with_rates) data.push_back({t, f(t).rate, 1, 1.0});
  }
  return FitSpline(FreeKnots(times, with_rates), data);
}

Jet Quintic(double t) {
  return {1 + t - 2 * t * t + t * t * t - 0.3 * std::pow(t, 4) + 0.2 * std::pow(t, 5),
          1 - 4 * t + 3 * t * t - 1.2 * t * t * t + std::pow(t, 4),
          -4 + 6 * t - 3.6 * t * t + 4 * t * t * t};
}

Jet Sine(double t) { return {std::sin(3 * t), 3 * std::cos(3 * t), -9 * std::sin(3 * t)}; }

double WorstAcceleration(int n, bool with_rates) {
  const std::vector<double> times = UnevenTimes(n, 2.0);
  const Piecewise p = Through(times, Sine, with_rates);
  double worst = 0.0;
  for (double t = 0.0; t <= 2.0; t += 0.0037) {
    worst = std::max(worst, std::abs(Evaluate(p, t).acceleration - Sine(t).acceleration));
  }
  return worst;
}

TEST(QuinticSpline, ReproducesQuinticPolynomials) {
  for (const bool with_rates : {false, true}) {
    for (const int n : {6, 7, 8, 20}) {
      const Piecewise p = Through(UnevenTimes(n, 2.0), Quintic, with_rates);
      for (double t = 0.0; t <= 2.0; t += 0.1) {
        EXPECT_NEAR(Evaluate(p, t).value, Quintic(t).value, 1e-12) << n << " at " << t;
        EXPECT_NEAR(Evaluate(p, t).rate, Quintic(t).rate, 1e-11) << n << " at " << t;
        EXPECT_NEAR(Evaluate(p, t).acceleration, Quintic(t).acceleration, 1e-9) << n << " at " << t;
      }
    }
  }
  const Piecewise three = Through({0.0, 0.7, 1.0}, Quintic, true);
  EXPECT_NEAR(Evaluate(three, 0.3).value, Quintic(0.3).value, 1e-13);
}

// Second derivatives of quintic splines are of fourth order: half the step, a sixteenth.
TEST(QuinticSpline, AccelerationsConvergeInFourthOrderAtLeast) {
  for (const bool with_rates : {false, true}) {
    const double order =
        std::log2(WorstAcceleration(41, with_rates) / WorstAcceleration(81, with_rates));
    EXPECT_GT(order, 3.7) << with_rates;
  }
}

// One-sided derivatives of the neighbouring polynomials at a knot.
double JumpOf(const Piecewise& p, size_t knot, int order) {
  double left = 0.0, factor = 1.0;
  const double width = p.knots[knot] - p.knots[knot - 1];
  for (int k = Piecewise::kDegree; k >= order; --k) {
    double falling = 1.0;
    for (int d = 0; d < order; ++d) falling *= k - d;
    left = left * width + falling * p.coefficients[knot - 1][static_cast<size_t>(k)];
  }
  for (int d = 2; d <= order; ++d) factor *= d;
  return left - factor * p.coefficients[knot][static_cast<size_t>(order)];
}

TEST(QuinticSpline, IsAsSmoothAsItSays) {
  for (const bool with_rates : {false, true}) {
    const Piecewise p = Through(UnevenTimes(12, 2.0), Sine, with_rates);
    double fourth = 0.0, fifth = 0.0;
    for (size_t knot = 1; knot + 1 < p.knots.size(); ++knot) {
      for (const int order : {0, 1, 2, 3}) {
        EXPECT_NEAR(JumpOf(p, knot, order), 0.0, 1e-12 * std::pow(30.0, order)) << knot;
      }
      fourth = std::max(fourth, std::abs(JumpOf(p, knot, 4)));
      fifth = std::max(fifth, std::abs(JumpOf(p, knot, 5)));
    }
    EXPECT_EQ(fourth > 1e-3, with_rates);
    EXPECT_GT(fifth, 1e-3);
  }
}

// The trace of the influence matrix, against perturbing one datum after the other.
TEST(QuinticSpline, CountsItsParameters) {
  const std::vector<double> times = UnevenTimes(15, 1.0);
  const std::vector<double> knots = FreeKnots(times, false);
  for (const double lambda : {1e-9, 1e-4, 1e6}) {
    std::vector<SplineDatum> data;
    data.reserve(times.size());
    for (const double t : times) data.push_back({t, std::sin(5 * t), 0, 1.0 + t});
    const SplineFit fit = FitSmooth(knots, data, lambda);
    double trace = 0.0, misfit = 0.0;
    for (size_t i = 0; i < data.size(); ++i) {
      std::vector<SplineDatum> perturbed = data;
      perturbed[i].value += 1.0;
      const double at = times[i], before = Evaluate(fit.spline, at).value;
      trace += Evaluate(FitSpline(knots, perturbed, lambda), at).value - before;
      misfit += std::pow(data[i].weight * (before - data[i].value), 2);
    }
    EXPECT_NEAR(fit.parameters, trace, 1e-8) << lambda;
    EXPECT_NEAR(fit.misfit, misfit, 1e-12) << lambda;
    EXPECT_EQ(std::abs(fit.parameters - 3.0) < 1e-3, lambda > 1.0) << lambda;
  }
}

// ∫ f'''² vanishes for parabolas only: with a heavy λ, the least-squares parabola is left.
TEST(QuinticSpline, HeavySmoothingLeavesTheParabola) {
  const std::vector<double> times = UnevenTimes(30, 1.0);
  std::vector<SplineDatum> data;
  for (size_t i = 0; i < times.size(); ++i) {
    data.push_back({times[i], 2 - times[i] + 3 * times[i] * times[i], 0, 1.0});
  }
  const Piecewise exact = FitSpline(FreeKnots(times, false), data, 1e6);
  EXPECT_NEAR(Evaluate(exact, 0.37).acceleration, 6.0, 1e-8);
  data[7].value += 1.0;  // an outlier is spread, not followed
  const Piecewise p = FitSpline(FreeKnots(times, false), data, 1e6);
  EXPECT_NEAR(Evaluate(p, 0.1).acceleration, Evaluate(p, 0.9).acceleration, 1e-3);
  EXPECT_LT(std::abs(Evaluate(p, times[7]).value - data[7].value), 1.0);
  EXPECT_GT(std::abs(Evaluate(p, times[7]).value - data[7].value), 0.8);
}

// At the least of (1) its derivative in every direction g of the same splines vanishes:
// Σ w² (f − y) g + λ ∫ f''' g''' dt = 0, the integral here from the polynomials themselves.
TEST(QuinticSpline, SmoothingIsTheLeastOfMisfitAndTheExactIntegralOfRoughness) {
  std::vector<double> time_s;
  std::vector<SplineDatum> data, other;
  for (int i = 0; i < 24; ++i) {
    time_s.push_back(0.1 * i + 0.02 * std::sin(3.0 * i));
    const double t = time_s.back();
    data.push_back({t, std::sin(2.0 * t) + 0.1 * std::cos(37.0 * i), 0, 3.0});
    other.push_back({t, std::cos(11.0 * i), 0, 1.0});
  }
  const std::vector<double> knots = FreeKnots(time_s, false);
  const Piecewise g = FitSpline(knots, other);
  const auto third = [](const Piecewise& p, size_t i) {  // its coefficients on an interval
    const Piecewise::Polynomial& c = p.coefficients[i];
    return std::array{6.0 * c[3], 24.0 * c[4], 60.0 * c[5]};
  };
  for (const double lambda : {1e-4, 1e-2, 1.0}) {
    const Piecewise f = FitSpline(knots, data, lambda);
    double misfit = 0.0, roughness = 0.0;
    for (const SplineDatum& datum : data) {
      misfit += datum.weight * datum.weight * (Evaluate(f, datum.time_s).value - datum.value) *
                Evaluate(g, datum.time_s).value;
    }
    for (size_t i = 0; i < f.coefficients.size(); ++i) {
      const double width = f.knots[i + 1] - f.knots[i];
      const auto a = third(f, i), b = third(g, i);
      for (size_t j = 0; j < 3; ++j) {
        for (size_t k = 0; k < 3; ++k) {
          roughness += a[j] * b[k] * std::pow(width, static_cast<double>(j + k + 1)) /
                       static_cast<double>(j + k + 1);
        }
      }
    }
    EXPECT_GT(std::abs(misfit), 1e-3) << lambda;
    EXPECT_NEAR(misfit + lambda * roughness, 0.0, 1e-8 * std::abs(misfit)) << lambda;
  }
}

}  // namespace
}  // namespace mbv
