// Designs: balanced where they promise it, and each point a function of its number alone.
#include "features/study/design.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace mbv {
namespace {

std::vector<Axis> UnitAxes(size_t count) {
  return std::vector<Axis>(count, {.nominal = 0.5, .distribution = Uniform{0.0, 1.0}});
}

// How many of the points lie in each of `layers` equal layers of an axis.
std::vector<int> Layers(const DesignPoints& points, size_t axis, int layers) {
  std::vector<int> counts(static_cast<size_t>(layers), 0);
  for (std::uint64_t i = 0; i < points.count(); ++i) {
    ++counts[static_cast<size_t>(points.At(i)[axis] * layers)];
  }
  return counts;
}

TEST(Distribution, QuantilesOfTheNormalAreThoseOfTables) {
  const Distribution normal = Normal{10.0, 2.0};
  EXPECT_NEAR(Quantile(normal, 0.5), 10.0, 1e-14);
  EXPECT_NEAR(Quantile(normal, 0.975), 10.0 + 2.0 * 1.959963984540054, 1e-12);
  EXPECT_NEAR(Quantile(normal, 0.158655253931457), 8.0, 1e-12);
}

TEST(Distribution, LevelsAreEquallyLikely) {
  const Distribution levels = Levels{{1.0, 5.0, 7.0}};
  EXPECT_EQ(Quantile(levels, 0.33), 1.0);
  EXPECT_EQ(Quantile(levels, 0.34), 5.0);
  EXPECT_EQ(Quantile(levels, 0.999999), 7.0);
  EXPECT_EQ(Quantile(Uniform{2.0, 6.0}, 0.25), 3.0);
}

TEST(Design, SobolPutsOnePointIntoEachLayerOfEveryAxis) {
  const DesignPoints points(UnitAxes(7), {.kind = DesignKind::kSobol, .count = 64, .seed = 5});
  ASSERT_EQ(points.count(), 64u);
  for (size_t axis = 0; axis < 7; ++axis) {
    EXPECT_EQ(Layers(points, axis, 64), std::vector<int>(64, 1)) << axis;
  }
  // 2^6 points in 8 × 8 cells of the first two axes.
  std::set<std::pair<int, int>> cells;
  for (std::uint64_t i = 0; i < 64; ++i) {
    const auto p = points.At(i);
    cells.emplace(static_cast<int>(8 * p[0]), static_cast<int>(8 * p[1]));
  }
  EXPECT_EQ(cells.size(), 64u);
}

TEST(Design, LatinHypercubePutsOnePointIntoEachLayer) {
  const DesignPoints points(UnitAxes(3),
                            {.kind = DesignKind::kLatinHypercube, .count = 50, .seed = 7});
  for (size_t axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(Layers(points, axis, 50), std::vector<int>(50, 1)) << axis;
  }
}

TEST(Design, APointIsAFunctionOfItsNumberAlone) {
  for (const DesignKind kind :
       {DesignKind::kSobol, DesignKind::kSaltelli, DesignKind::kLatinHypercube}) {
    const Design design{.kind = kind, .count = 32, .seed = 3};
    const DesignPoints forwards(UnitAxes(4), design), backwards(UnitAxes(4), design);
    std::vector<std::vector<double>> all;
    for (std::uint64_t i = 0; i < forwards.count(); ++i) all.push_back(forwards.At(i));
    for (std::uint64_t i = forwards.count(); i-- > 0;) EXPECT_EQ(backwards.At(i), all[i]) << i;
    const DesignPoints other(UnitAxes(4), {.kind = kind, .count = 32, .seed = 4});
    EXPECT_NE(other.At(0), all[0]);
  }
}

TEST(Design, SaltelliBlocksExchangeOneColumn) {
  const DesignPoints points(UnitAxes(3), {.kind = DesignKind::kSaltelli, .count = 8, .seed = 1});
  ASSERT_EQ(points.count(), 8u * 5u);
  for (std::uint64_t block = 0; block < 8; ++block) {
    const auto a = points.At(5 * block), b = points.At(5 * block + 1);
    for (size_t i = 0; i < 3; ++i) {
      const auto ab = points.At(5 * block + 2 + i);
      for (size_t d = 0; d < 3; ++d) EXPECT_EQ(ab[d], d == i ? b[d] : a[d]);
      EXPECT_NE(a[i], b[i]);
    }
  }
}

TEST(Design, GridCombinesAllLevelsLastFastest) {
  const std::vector<Axis> axes = {{1.0, Levels{{1, 2}}}, {5.0, Levels{{5, 6, 7}}}};
  const DesignPoints points(axes, {.kind = DesignKind::kGrid});
  ASSERT_EQ(points.count(), 6u);
  EXPECT_EQ(points.At(1), (std::vector<double>{1, 6}));
  EXPECT_EQ(points.At(5), (std::vector<double>{2, 7}));
}

TEST(Design, OneAtATimeLeavesTheOthersNominal) {
  const std::vector<Axis> axes = {{1.0, Normal{1.0, 0.1}}, {5.0, Levels{{5, 6, 7}}}};
  const DesignPoints points(axes, {.kind = DesignKind::kOneAtATime});
  ASSERT_EQ(points.count(), 6u);
  EXPECT_EQ(points.At(0), (std::vector<double>{1.0, 5.0}));
  EXPECT_EQ(points.At(1), (std::vector<double>{0.9, 5.0}));
  EXPECT_EQ(points.At(2), (std::vector<double>{1.1, 5.0}));
  EXPECT_EQ(points.At(5), (std::vector<double>{1.0, 7.0}));
}

TEST(Design, GridsTooLargeToCountSaturate) {
  const std::vector<Axis> axes(70, {0.0, Levels{{1, 2}}});
  EXPECT_EQ(DesignPoints(axes, {.kind = DesignKind::kGrid}).count(), ~std::uint64_t{0});
}

TEST(Permutation, ReachesEachPlaceOnce) {
  for (const std::uint64_t count : {1u, 2u, 3u, 16u, 100u, 1025u}) {
    std::vector<std::uint64_t> places;
    for (std::uint64_t i = 0; i < count; ++i) places.push_back(Permuted(i, count, 11));
    std::sort(places.begin(), places.end());
    for (std::uint64_t i = 0; i < count; ++i) ASSERT_EQ(places[i], i) << count;
  }
}

// Correlation of two columns of many points, and the columns' own deviations.
struct Together {
  double coefficient, first, second;
};
Together TogetherOf(const DesignPoints& points) {
  const auto n = static_cast<double>(points.count());
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (std::uint64_t i = 0; i < points.count(); ++i) {
    const auto x = points.At(i);
    a += x[0] / n;
    b += x[1] / n;
  }
  for (std::uint64_t i = 0; i < points.count(); ++i) {
    const auto x = points.At(i);
    aa += (x[0] - a) * (x[0] - a) / n;
    bb += (x[1] - b) * (x[1] - b) / n;
    ab += (x[0] - a) * (x[1] - b) / n;
  }
  return {ab / std::sqrt(aa * bb), std::sqrt(aa), std::sqrt(bb)};
}

TEST(Design, CorrelatedNumbersAreSoAndKeepTheirDistributions) {
  const std::vector<Axis> axes = {
      {1.0, Normal{1.0, 0.1}}, {5.0, Normal{5.0, 2.0}}, {0.0, Uniform{0.0, 1.0}}};
  for (const DesignKind kind : {DesignKind::kSobol, DesignKind::kLatinHypercube}) {
    for (const double wanted : {-0.6, 0.0, 0.8}) {
      Design design{.kind = kind, .count = 4096};
      if (wanted != 0.0) design.correlations = {{0, 1, wanted}};
      const Together found = TogetherOf(DesignPoints(axes, design));
      EXPECT_NEAR(found.coefficient, wanted, 0.03);
      EXPECT_NEAR(found.first, 0.1, 0.002);
      EXPECT_NEAR(found.second, 2.0, 0.05);
    }
  }
}

TEST(Design, CorrelationsLeaveOtherNumbersAlone) {
  const std::vector<Axis> axes = {
      {1.0, Normal{1.0, 0.1}}, {0.0, Uniform{0.0, 1.0}}, {5.0, Normal{5.0, 2.0}}};
  const Design plain{.kind = DesignKind::kSobol, .count = 64};
  Design design = plain;
  design.correlations = {{0, 2, 0.9}};
  const DesignPoints bound(axes, design), free(axes, plain);
  for (std::uint64_t i = 0; i < 64; ++i) {
    EXPECT_EQ(bound.At(i)[1], free.At(i)[1]);
    EXPECT_NEAR(bound.At(i)[0], free.At(i)[0], 1e-15);  // the first row of L is 1, 0, 0
  }
  EXPECT_NE(bound.At(5)[2], free.At(5)[2]);
}

TEST(Design, ImpossibleCorrelationsHaveANegativeEigenvalue) {
  Design design;
  design.correlations = {{0, 1, 0.9}, {1, 2, 0.9}, {0, 2, -0.9}};
  EXPECT_NEAR(SmallestEigenvalue(CorrelationMatrix(design, 3)), -0.8, 1e-12);
  design.correlations.pop_back();
  design.correlations.push_back({0, 2, 0.9});
  EXPECT_NEAR(SmallestEigenvalue(CorrelationMatrix(design, 3)), 0.1, 1e-12);
}

}  // namespace
}  // namespace mbv
