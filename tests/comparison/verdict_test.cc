// What every comparison judges alike, by hand.
#include "comparison/verdict.h"

#include <gtest/gtest.h>

#include <limits>

namespace mbv {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

std::vector<PairDistance> SortedDistances(double simulated_analytic, double reference_analytic,
                                          double simulated_reference) {
  std::vector<PairDistance> distances = {{"simulated", "analytic", simulated_analytic},
                                         {"reference", "analytic", reference_analytic},
                                         {"simulated", "reference", simulated_reference}};
  SortByDistance(&distances);
  return distances;
}

TEST(Verdict, TheOneFarFromTwoThatAreCloseIsOdd) {
  EXPECT_EQ(OddOneOut(SortedDistances(1.0, 1e-6, 1.0)), "simulated");
  EXPECT_EQ(OddOneOut(SortedDistances(1e-6, 1.0, 1.0)), "reference");
  EXPECT_EQ(OddOneOut(SortedDistances(1.0, 1.0, 1e-6)), "analytic");
}

TEST(Verdict, NoWitnessIsOddUnlessClearlyFarther) {
  EXPECT_EQ(OddOneOut(SortedDistances(9.9, 1.0, 9.9)), "");
  EXPECT_EQ(OddOneOut(SortedDistances(10.0, 1.0, 10.0)), "simulated");
  EXPECT_EQ(OddOneOut(SortedDistances(1.0, 1.0, 1.0)), "");
}

TEST(Verdict, OneOfFourIsOddWhereTheOthersAgree) {
  const auto distances = [](double among_three, double to_fourth) {
    std::vector<PairDistance> all = {{"a", "b", among_three}, {"a", "c", among_three},
                                     {"b", "c", among_three}, {"d", "a", to_fourth},
                                     {"d", "b", to_fourth},   {"d", "c", to_fourth}};
    SortByDistance(&all);
    return all;
  };
  EXPECT_EQ(OddOneOut(distances(1e-9, 1e-3)), "d");
  EXPECT_EQ(OddOneOut(distances(1e-9, kNothing)), "d");
  EXPECT_EQ(OddOneOut(distances(1e-3, 9e-3)), "");
  EXPECT_EQ(NearestOf(std::string("d"), distances(1e-9, 1e-3))->value, 1e-3);
  // Two against two.
  std::vector<PairDistance> split = {{"a", "b", 1e-9}, {"c", "d", 1e-9}, {"a", "c", 1.0},
                                     {"a", "d", 1.0},  {"b", "c", 1.0},  {"b", "d", 1.0}};
  SortByDistance(&split);
  EXPECT_EQ(OddOneOut(split), "");
}

TEST(Verdict, WhatIsNotANumberIsFarthest) {
  const std::vector<PairDistance> sorted = SortedDistances(kNothing, 1.0, kNothing);
  EXPECT_EQ(sorted[0].name(), "reference_vs_analytic");
  EXPECT_EQ(OddOneOut(sorted), "simulated");
}

TEST(Verdict, TwoWitnessesDoNotTellWhoIsOdd) {
  EXPECT_EQ(OddOneOut(std::vector<PairDistance>{{"simulated", "analytic", 1.0}}), "");
}

TEST(Verdict, OnlyANumberWithinALimitPasses) {
  EXPECT_TRUE(Passes(1.0, 1.0));
  EXPECT_FALSE(Passes(1.0 + 1e-15, 1.0));
  EXPECT_FALSE(Passes(kNothing, 1.0));
  EXPECT_FALSE(Passes(0.0, std::nullopt));
}

TEST(Verdict, SwitchedOffChecksNeitherFailNorPass) {
  Comparison comparison;
  comparison.checks.resize(5);
  for (size_t k : {0, 1, 3, 4}) comparison.checks[k].limit = 1.0;
  for (size_t k : {0, 3, 4}) comparison.checks[k].pass = true;
  comparison.checks[4].insensitive = "wide";
  EXPECT_EQ(comparison.failed(), 1u);
  EXPECT_EQ(comparison.verified(), 2u);
  EXPECT_EQ(comparison.followed(), 0u);
  EXPECT_EQ(comparison.insensitive(), 1u);
}

}  // namespace
}  // namespace mbv
