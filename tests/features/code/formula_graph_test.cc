// Formulas: simplified, differentiated, evaluated.
#include "features/code/formula_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

std::string TextOf(Expr e) {
  const std::string sign = "sign";
  return FormulaText({e}, sign).results()[0];
}

TEST(FormulaGraph, Simplifies) {
  FormulaGraph graph;
  const Expr x = graph.Input("x"), y = graph.Input("y");
  EXPECT_EQ(x + 0.0, x);
  EXPECT_EQ(x * 1.0, x);
  EXPECT_TRUE(graph.IsZero(x * 0.0));
  EXPECT_TRUE(graph.IsZero(x - x));
  EXPECT_EQ(x * y, y * x);
  EXPECT_EQ(-(-x), x);
  EXPECT_EQ(x + -y, x - y);
  EXPECT_EQ(-(x - y), y - x);
  EXPECT_EQ(Expr(2.0) * 3.0, Expr(6.0));
  EXPECT_EQ(-x * -y, x * y);
  EXPECT_FALSE(x - y == y - x);
}

// The text has the value of the formula: parentheses where they are needed, none lost.
TEST(FormulaGraph, WritesWhatItMeans) {
  FormulaGraph graph;
  const Expr x = graph.Input("x"), y = graph.Input("y"), z = graph.Input("z");
  EXPECT_EQ(TextOf(x - (y - z)), "x - (y - z)");
  EXPECT_EQ(TextOf(x * (y + z)), "x*(y + z)");
  EXPECT_EQ(TextOf(x / (y * z)), "x/(y*z)");
  EXPECT_EQ(TextOf(-(x + y)), "-(x + y)");
  EXPECT_EQ(TextOf(x * Expr(-2.0)), "x*(-2.0)");
  EXPECT_EQ(TextOf(sin(x) / cos(y)), "sin(x)/cos(y)");
  EXPECT_EQ(NumberText(1.0), "1.0");
  EXPECT_EQ(NumberText(0.1), "0.1");
}

TEST(FormulaGraph, Differentiates) {
  FormulaGraph graph;
  const Expr x = graph.Input("x"), y = graph.Input("y");
  const std::vector<Expr> all = {x * y / (x + y),  sqrt(x * x + y),     sin(x * y),
                                 cos(x) * exp(-y), atan2(x * y, x + y), -(x - y * y)};
  const std::vector<Expr> rates = graph.Derivatives(all, {{x, Expr(0.3)}, {y, Expr(-0.7)}});
  std::vector<double> work, up, down, exact;
  constexpr double kStep = 1e-6;
  FormulaTape(all).Evaluate<double>({1.1 + 0.3 * kStep, 0.4 - 0.7 * kStep}, &work, &up);
  FormulaTape(all).Evaluate<double>({1.1 - 0.3 * kStep, 0.4 + 0.7 * kStep}, &work, &down);
  FormulaTape(rates).Evaluate<double>({1.1, 0.4}, &work, &exact);
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_NEAR(exact[i], (up[i] - down[i]) / (2.0 * kStep), 1e-9) << i;
    EXPECT_GT(std::abs(exact[i]), 0.01) << i;
  }
}

TEST(FormulaGraph, FindsWhatStays) {
  FormulaGraph graph;
  const Expr x = graph.Input("x"), y = graph.Input("y");
  const Expr fixed = sin(y) * 2.0;
  const std::vector<Expr> parts = graph.FixedParts({fixed * x + fixed}, {x});
  ASSERT_EQ(parts.size(), 1U);
  EXPECT_EQ(parts[0], fixed);
  const std::string sign = "sign";
  const FormulaText text({fixed * x + fixed}, sign, parts, "k");
  EXPECT_FALSE(text.Uses({y}));
  EXPECT_TRUE(text.Uses({x}));
}

}  // namespace
}  // namespace mbv
