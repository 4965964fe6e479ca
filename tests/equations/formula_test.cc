// Formulas that differentiate: values as of muParser, derivatives as of differences.
#include "equations/formula.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "base/types.h"
#include "model_file/yaml/expressions.h"

namespace mbv {
namespace {

const std::vector<std::string> kNames = {"a", "x"};

Jet At(const std::string& text, const Jet& x, double a = 1.3) {
  std::vector<FormulaError> errors;
  const auto formula = DifferentiableFormula::Compile(text, kNames, {"x"}, &errors);
  EXPECT_TRUE(errors.empty()) << text << ": " << (errors.empty() ? "" : errors.front().message);
  return formula.At({.names = {{a, 0, 0}, x}});
}

const char* const kExpressions[] = {"x",
                                    "a*x + 2",
                                    "x - a - x*x",
                                    "3 - 2 - 1",
                                    "12/3/2",
                                    "-x^2",
                                    "2^3^0.5",
                                    "x^3",
                                    "x^-2",
                                    "x^0.5",
                                    "x^a",
                                    "a^x",
                                    "x^x",
                                    "(1 + x)/(2 - x*x)",
                                    "sin(x)",
                                    "cos(x)",
                                    "tan(x)",
                                    "asin(x)",
                                    "acos(x)",
                                    "atan(x)",
                                    "sinh(x)",
                                    "cosh(x)",
                                    "tanh(x)",
                                    "exp(x)",
                                    "ln(x)",
                                    "log(x)",
                                    "sqrt(x)",
                                    "abs(x - 2)",
                                    "atan2(x, 1 - 2*x)",
                                    "atan2(-x, x - 2)",
                                    "atan2(1 + x, 0.1*x)",
                                    "min(x, a*x*x)",
                                    "max(x, a*x*x)",
                                    "x > 0.5 ? sin(x) : cos(x)",
                                    "x < 0.5 && a > 1 ? x : x*x",
                                    "x <= 0.1 || a != a ? 1 : x^2",
                                    "sign(x - 0.5)*x",
                                    "sqrt(a^2 - (0.3*sin(x))^2)*cos(x + pi)"};

TEST(Formula, HasTheValuesOfModelFiles) {
  for (const char* text : kExpressions) {
    for (const double x : {0.3, 0.55, 0.8}) {
      Scope scope;
      scope.Set("a", 1.3);
      scope.Set("x", x);
      const ExpressionResult expected = scope.Evaluate(text);
      ASSERT_TRUE(expected.value) << text << ": " << expected.error;
      const Jet value = At(text, {x, 0, 0});
      EXPECT_NEAR(value.value, *expected.value, 4e-16 * std::max(1.0, std::abs(value.value)) * 4)
          << text << " at " << x;
    }
  }
}

TEST(Formula, DifferentiatesTwice) {
  constexpr double h = 1e-4;
  for (const char* text : kExpressions) {
    for (const double x : {0.3, 0.55, 0.8}) {
      std::array<double, 5> f{};
      for (int k = 0; k < 5; ++k)
        f[static_cast<size_t>(k)] = At(text, {x + (k - 2) * h, 0, 0}).value;
      const double first = (f[0] - 8 * f[1] + 8 * f[3] - f[4]) / (12 * h);
      const double second = (-f[0] + 16 * f[1] - 30 * f[2] + 16 * f[3] - f[4]) / (12 * h * h);
      // x moves with a rate and an acceleration.
      const Jet value = At(text, {x, 0.7, -1.9});
      EXPECT_NEAR(value.rate, first * 0.7, 1e-9 * std::max(1.0, std::abs(first))) << text << x;
      EXPECT_NEAR(value.acceleration, second * 0.49 - first * 1.9,
                  1e-6 * std::max(1.0, std::abs(second)))
          << text << " at " << x;
    }
  }
}

TEST(Formula, NamesRatesAndPartialDerivatives) {
  std::vector<FormulaError> errors;
  const auto formula =
      DifferentiableFormula::Compile("x_dd + 10*x_d^2 + 100*d(a, x)", kNames, {"x"}, &errors);
  ASSERT_TRUE(errors.empty());
  const Jet value = formula.At({.names = {{1.3, 0, 0}, {0.5, 3, 7}}, .partial = {{0.25}, {1}}});
  EXPECT_DOUBLE_EQ(value.value, 7 + 90 + 25);
  // It is unknown how these move.
  EXPECT_TRUE(std::isnan(value.rate));
}

TEST(Formula, HasNoValueOutsideOfADomain) {
  EXPECT_TRUE(std::isnan(At("sqrt(x - 1)", {0.5, 0, 0}).value));
  EXPECT_TRUE(std::isnan(At("asin(x)", {1.5, 0, 0}).value));
}

TEST(Formula, SaysWhatIsWrongAndWhere) {
  struct Wrong {
    const char* text;
    size_t at;
    const char* message;
    const char* hint;
  };
  for (const Wrong& wrong : {Wrong{"a + ", 4, "ends too early", ""},
                             {"(a + x", 6, "')' is missing", ""},
                             {"a b", 2, "'b' is not expected here", ""},
                             {"a ** 2", 2, "'**' is no operator", "a^b"},
                             {"a + y", 4, "'y' is not known", ""},
                             {"sin(a, x)", 0, "sin takes one number, not 2", ""},
                             {"sinn(a)", 0, "there is no function 'sinn'", "sin"},
                             {"x = 2", 2, "'=' is not expected here", "=="},
                             {"a ? x", 5, "':' is missing behind '?'", ""},
                             {"d(x, a)", 6, "'a' is no command", ""},
                             {"", 0, "ends too early", ""}}) {
    std::vector<FormulaError> errors;
    (void)DifferentiableFormula::Compile(wrong.text, kNames, {"x"}, &errors);
    ASSERT_EQ(errors.size(), 1u) << wrong.text;
    EXPECT_EQ(errors[0].at, wrong.at) << wrong.text;
    EXPECT_EQ(errors[0].message, wrong.message);
    EXPECT_NE(errors[0].hint.find(wrong.hint), std::string::npos) << errors[0].hint;
  }
  std::vector<FormulaError> errors;
  (void)DifferentiableFormula::Compile(std::string(100000, '('), kNames, {}, &errors);
  EXPECT_EQ(errors.at(0).message, "is nested too deeply");
}

}  // namespace
}  // namespace mbv
