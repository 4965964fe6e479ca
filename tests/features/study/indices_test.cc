// Sobol' indices of functions that have them in closed form, and what statistics say of few values.
#include "features/study/summary.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "features/study/design.h"

namespace mbv {
namespace {

using Function = std::function<double(const std::vector<double>&)>;

std::vector<double> Evaluate(const Function& f, size_t numbers, Uniform range, std::uint64_t count,
                             std::uint64_t seed = 1) {
  const DesignPoints points(std::vector<Axis>(numbers, {0.0, range}),
                            {.kind = DesignKind::kSaltelli, .count = count, .seed = seed});
  std::vector<double> values;
  for (std::uint64_t i = 0; i < points.count(); ++i) values.push_back(f(points.At(i)));
  return values;
}

// sin x1 + 7 sin² x2 + 0.1 x3⁴ sin x1 on (−π, π)³ [Ishigami, Homma 1990].
double Ishigami(const std::vector<double>& x) {
  return std::sin(x[0]) + 7.0 * std::pow(std::sin(x[1]), 2) +
         0.1 * std::pow(x[2], 4) * std::sin(x[0]);
}

struct IshigamiTruth {
  double variance, first[3], total[3];
};
IshigamiTruth TruthOfIshigami() {
  const double pi4 = std::pow(std::numbers::pi, 4), a = 7.0, b = 0.1;
  const double v1 = 0.5 * std::pow(1.0 + b * pi4 / 5.0, 2), v2 = a * a / 8.0;
  const double v13 = b * b * pi4 * pi4 * (1.0 / 18.0 - 1.0 / 50.0), v = v1 + v2 + v13;
  return {v, {v1 / v, v2 / v, 0.0}, {(v1 + v13) / v, v2 / v, v13 / v}};
}

constexpr double kPi = std::numbers::pi;

TEST(SobolIndices, FindThoseOfIshigamisFunction) {
  const auto result = SobolIndices(Evaluate(Ishigami, 3, {-kPi, kPi}, 65536), 3);
  const IshigamiTruth truth = TruthOfIshigami();
  EXPECT_NEAR(result.mean, 3.5, 0.01);
  EXPECT_NEAR(result.variance, truth.variance, 0.01 * truth.variance);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(result.indices[i].first, truth.first[i], 0.01) << i;
    EXPECT_NEAR(result.indices[i].total, truth.total[i], 0.01) << i;
    EXPECT_LE(result.indices[i].first_interval.lower, truth.first[i]);
    EXPECT_GE(result.indices[i].first_interval.upper, truth.first[i]);
    EXPECT_LE(result.indices[i].total_interval.lower, truth.total[i]);
    EXPECT_GE(result.indices[i].total_interval.upper, truth.total[i]);
  }
}

// The intervals are narrow enough to exclude another function's indices.
TEST(SobolIndices, IntervalsExcludeIndicesOfAnotherFunction) {
  const auto perturbed = [](const std::vector<double>& x) { return Ishigami(x) + 2.0 * x[2]; };
  const auto result = SobolIndices(Evaluate(perturbed, 3, {-kPi, kPi}, 4096), 3);
  const IshigamiTruth truth = TruthOfIshigami();
  EXPECT_LT(result.indices[0].first_interval.upper, truth.first[0]);
  EXPECT_GT(result.indices[2].first_interval.lower, truth.first[2]);
}

// Π (|4 x_i − 2| + a_i)/(1 + a_i) on (0, 1)⁴ [Sobol' 2003]; variances of the factors are
// v_i = 1/(3 (1 + a_i)²).
constexpr double kG[] = {0.0, 1.0, 4.5, 9.0};
double GFunction(const std::vector<double>& x) {
  double product = 1.0;
  for (size_t i = 0; i < x.size(); ++i) {
    product *= (std::abs(4.0 * x[i] - 2.0) + kG[i]) / (1.0 + kG[i]);
  }
  return product;
}

// Share of all intervals of a function's indices, over many seeds, that contain the true ones when
// they are stretched about their middles.
class IntervalHits {
 public:
  IntervalHits(const Function& f, Uniform range, std::vector<double> first,
               std::vector<double> total, std::uint64_t blocks)
      : first_(std::move(first)), total_(std::move(total)) {
    for (std::uint64_t seed = 1; seed <= 200; ++seed) {
      results_.push_back(
          SobolIndices(Evaluate(f, first_.size(), range, blocks, seed), first_.size()));
    }
  }

  [[nodiscard]] double At(double stretch) const {
    int hits = 0, all = 0;
    const auto count = [&](const Interval& interval, double truth) {
      const double middle = 0.5 * (interval.lower + interval.upper);
      hits += std::abs(truth - middle) <= stretch * 0.5 * (interval.upper - interval.lower) ? 1 : 0;
      ++all;
    };
    for (const SobolResult& result : results_) {
      for (size_t i = 0; i < first_.size(); ++i) {
        count(result.indices[i].first_interval, first_[i]);
        count(result.indices[i].total_interval, total_[i]);
      }
    }
    return static_cast<double>(hits) / all;
  }

 private:
  std::vector<double> first_, total_;
  std::vector<SobolResult> results_;
};

// 95 % and three standard errors of a share of 200 independent seeds, halved, since the indices of
// one seed vary mostly by themselves.
constexpr double kStrays = 0.5 * 3.0 * 0.0154;

void ExpectNinetyFivePercent(const IntervalHits& hits) {
  EXPECT_NEAR(hits.At(1.0), 0.95, kStrays);
  // What is half as wide again, or narrower by that, does not pass.
  EXPECT_GT(hits.At(1.5), 0.95 + kStrays);
  EXPECT_LT(hits.At(1.0 / 1.5), 0.95 - kStrays);
}

TEST(SobolIndices, IntervalsOfIshigamisFunctionContainTheTruthNinetyFiveTimesInAHundred) {
  const IshigamiTruth truth = TruthOfIshigami();
  for (const std::uint64_t blocks : {64u, 512u}) {
    SCOPED_TRACE(blocks);
    ExpectNinetyFivePercent({Ishigami,
                             {-kPi, kPi},
                             {truth.first, truth.first + 3},
                             {truth.total, truth.total + 3},
                             blocks});
  }
}

TEST(SobolIndices, IntervalsOfAGFunctionContainTheTruthNinetyFiveTimesInAHundred) {
  double product = 1.0;
  std::vector<double> first, total;
  for (const double a : kG) {
    first.push_back(1.0 / (3.0 * (1.0 + a) * (1.0 + a)));
    product *= 1.0 + first.back();
  }
  for (double& v : first) {
    total.push_back(v * product / (1.0 + v) / (product - 1.0));
    v /= product - 1.0;
  }
  for (const std::uint64_t blocks : {64u, 512u}) {
    SCOPED_TRACE(blocks);
    ExpectNinetyFivePercent({GFunction, {0.0, 1.0}, first, total, blocks});
  }
}

TEST(SobolIndices, OfASumAreTheSharesOfItsParts) {
  const auto sum = [](const std::vector<double>& x) { return 1e6 + 3.0 * x[0] + 4.0 * x[1]; };
  const auto result = SobolIndices(Evaluate(sum, 2, {0.0, 1.0}, 1024), 2);
  EXPECT_NEAR(result.indices[0].first, 0.36, 1e-2);
  EXPECT_NEAR(result.indices[1].total, 0.64, 1e-2);
}

TEST(SobolIndices, LeaveBlocksWithoutAValueOut) {
  const auto sum = [](const std::vector<double>& x) { return x[0] + x[1]; };
  std::vector<double> values = Evaluate(sum, 2, {0.0, 1.0}, 64);
  values[4 * 3 + 2] = std::nan("");
  const auto result = SobolIndices(values, 2);
  EXPECT_EQ(result.blocks, 63u);
  EXPECT_EQ(result.left_out, 1u);
  EXPECT_TRUE(std::isfinite(result.indices[0].first));
}

TEST(SobolIndices, OfAConstantAreNone) {
  const auto result = SobolIndices(std::vector<double>(4 * 16, 0.1), 2);
  EXPECT_TRUE(std::isnan(result.indices[0].first));
  EXPECT_TRUE(std::isnan(SobolIndices({}, 2).indices[1].total));
}

TEST(Statistics, PercentilesLieBetweenValues) {
  const std::vector<double> values = {1, 2, 3, 4, 5};
  EXPECT_EQ(Percentile(values, 0.5), 3.0);
  EXPECT_EQ(Percentile(values, 0.0), 1.0);
  EXPECT_EQ(Percentile(values, 1.0), 5.0);
  EXPECT_NEAR(Percentile(values, 0.05), 1.2, 1e-15);
  EXPECT_TRUE(std::isnan(Percentile({}, 0.5)));
}

// (0.025)^(1/n) and 1 − (0.025)^(1/n) at the ends; the rest from tables (R: binom.test).
TEST(Statistics, ClopperPearsonIsExact) {
  EXPECT_EQ(ClopperPearson(0, 10).lower, 0.0);
  EXPECT_NEAR(ClopperPearson(0, 10).upper, 1.0 - std::pow(0.025, 0.1), 1e-12);
  EXPECT_EQ(ClopperPearson(10, 10).upper, 1.0);
  EXPECT_NEAR(ClopperPearson(10, 10).lower, std::pow(0.025, 0.1), 1e-12);
  EXPECT_NEAR(ClopperPearson(3, 100).lower, 0.006229972, 1e-8);
  EXPECT_NEAR(ClopperPearson(3, 100).upper, 0.08517605, 1e-8);
  EXPECT_TRUE(std::isnan(ClopperPearson(0, 0).upper));
}

TEST(Statistics, HistogramsCountEveryValue) {
  std::vector<double> values(1000);
  for (int i = 0; i < 1000; ++i) values[static_cast<size_t>(i)] = i * 0.001;
  const Histogram histogram = HistogramOf(values);
  std::uint64_t sum = 0;
  for (const auto count : histogram.counts) sum += count;
  EXPECT_EQ(sum, 1000u);
  EXPECT_GE(histogram.counts.size(), 5u);
  // Freedman and Diaconis: 2 · 149.5 / 300^(1/3) = 44.7 wide, so 7 bins over 299.
  values.clear();
  for (int i = 0; i < 300; ++i) values.push_back(i);
  EXPECT_EQ(HistogramOf(values).counts, (std::vector<std::uint64_t>{43, 43, 43, 42, 43, 43, 43}));
  EXPECT_EQ(HistogramOf(std::vector<double>(7, 2.0)).counts, (std::vector<std::uint64_t>{7}));
  EXPECT_TRUE(HistogramOf({}).counts.empty());
}

}  // namespace
}  // namespace mbv
