#include "model_file/yaml/expressions.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace mbv {
namespace {

TEST(Expressions, AreArithmeticWithFunctionsAndPi) {
  Scope scope;
  EXPECT_DOUBLE_EQ(*scope.Evaluate("1 + 2*3^2").value, 19.0);
  EXPECT_DOUBLE_EQ(*scope.Evaluate("sqrt(0.625^2 - (0.455-0.21)^2)").value, 0.574978260458602);
  EXPECT_DOUBLE_EQ(*scope.Evaluate("atan2(1, -1)").value, 0.75 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(*scope.Evaluate("-pi/2").value, -std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(*scope.Evaluate("2 > 1 ? 3 : 4").value, 3.0);
  EXPECT_DOUBLE_EQ(*scope.Evaluate("+1.5e-3").value, 1.5e-3);
}

TEST(Expressions, ParametersMayStandInAnyOrder) {
  Scope scope;
  scope.Define("c", "a + b");
  scope.Define("b", "2*a");
  scope.Define("a", "1e1");
  EXPECT_DOUBLE_EQ(*scope.Lookup("c").value, 30.0);
}

TEST(Expressions, AUnitAppliesToTheWholeExpression) {
  Scope scope;
  scope.Define("angle", "90 + 90", kDeg);
  EXPECT_DOUBLE_EQ(*scope.Lookup("angle").value, std::numbers::pi);
}

TEST(Expressions, InnerParametersHideOuterOnesAndSeeThem) {
  Scope model;
  model.Define("r", "2");
  model.Define("k", "10");
  Scope limb(&model);
  limb.Define("k", "r + 1");
  EXPECT_DOUBLE_EQ(*limb.Evaluate("k*r").value, 6.0);
  EXPECT_DOUBLE_EQ(*model.Evaluate("k*r").value, 20.0);
}

TEST(Expressions, AnUnknownSymbolIsNamedWithItsNeighbour) {
  Scope scope;
  scope.Define("L5", "1");
  const ExpressionResult symbol = scope.Evaluate("2*L6");
  EXPECT_FALSE(symbol.value);
  EXPECT_EQ(symbol.error, "has the unknown symbol 'L6'");
  EXPECT_EQ(symbol.hint, "did you mean 'L5'?");
  const ExpressionResult function = scope.Evaluate("sine(L5)");
  EXPECT_EQ(function.error, "has the unknown function 'sine'");
  EXPECT_EQ(function.hint, "did you mean 'sin'?");
}

TEST(Expressions, ACycleIsReportedOnceWithItsPath) {
  Scope scope;
  scope.Define("a", "b + 1");
  scope.Define("b", "c");
  scope.Define("c", "2*a");
  scope.Define("d", "a + 1");
  EXPECT_EQ(scope.Lookup("a").error, "is a cycle of parameters: a → b → c → a");
  // Who depends on a failed parameter stays silent: the cause has its own finding.
  for (const char* name : {"b", "c", "d"}) {
    EXPECT_FALSE(scope.Lookup(name).value) << name;
    EXPECT_EQ(scope.Lookup(name).error, "") << name;
  }
}

TEST(Expressions, NonFiniteResultsAreRefused) {
  Scope scope;
  for (const char* text : {"1/0", "sqrt(-1)", "nan", "inf", "-inf", "1e999", "10^400"}) {
    const ExpressionResult result = scope.Evaluate(text);
    EXPECT_FALSE(result.value) << text;
    EXPECT_NE(result.error.find("finite"), std::string::npos) << text << ": " << result.error;
  }
}

TEST(Expressions, NumbersBeyondBoundsAreRefused) {
  Scope scope;
  for (const char* text : {"1e31", "-2e30", "10^30 * 1.1", "-1e300"}) {
    const ExpressionResult result = scope.Evaluate(text);
    EXPECT_FALSE(result.value) << text;
    EXPECT_NE(result.error.find("violates |number| <= 1e+30"), std::string::npos) << result.error;
  }
  EXPECT_EQ(scope.Evaluate("-1e30").value, -1e30);
}

TEST(Expressions, WhatIsNotAnExpressionIsRefusedWithoutThrowing) {
  Scope scope;
  scope.Define("a", "1");
  for (const char* text : {"", " ", "1 +", "(2", "2)", "a = 3", "1, 2", "\"text\"", "a b", "1..2",
                           "sin", "sin(", "@", "2 ** 3", "0x10", "a[1]", "1 ? 2", "ä"}) {
    const ExpressionResult result = scope.Evaluate(text);
    EXPECT_FALSE(result.value) << text << " = " << result.value.value_or(0);
    EXPECT_NE(result.error, "") << text;
  }
  EXPECT_FALSE(scope.Evaluate(std::string(100'000, '(')).value);
  EXPECT_DOUBLE_EQ(*scope.Lookup("a").value, 1.0);  // nothing assigned it
}

TEST(Expressions, AVeryLongChainOfParametersIsRefused) {
  Scope scope;
  scope.Define("p0", "1");
  for (int i = 1; i < 5000; ++i) {
    scope.Define("p" + std::to_string(i), "p" + std::to_string(i - 1));
  }
  EXPECT_FALSE(scope.Lookup("p4999").value);
  EXPECT_EQ(scope.Lookup("p4799").error, "is the end of a very long chain of parameters");
}

// Texts are kept parsed: what no parser takes is refused in the same words with other numbers.
TEST(Expressions, WhatIsNotAnExpressionIsNoneWithOtherNumbersEither) {
  for (const char* text : {"r*pi.3", "r*(2", "r + ;", "sin(r, 2)"}) {
    std::vector<std::string> errors;
    for (const char* value : {"1", "2", "3"}) {
      Scope scope;
      scope.Define("r", value);
      errors.push_back(scope.Evaluate(text).error);
    }
    EXPECT_TRUE(errors[0].starts_with("is not an expression: ")) << text << ": " << errors[0];
    EXPECT_EQ(errors, std::vector(3, errors[0])) << text;
  }
}

TEST(Expressions, WhatIsRefusedHasAReason) {
  Scope scope;
  scope.Define("a", "1");
  const auto said = [&](const std::string& text) { return scope.Evaluate(text).error; };
  EXPECT_EQ(said("a = 3"), "is not an expression: = and \" have no meaning here");
  EXPECT_EQ(said("a += 3"), said("a = 3"));
  EXPECT_EQ(said("a*\"x\""), said("a = 3"));
  EXPECT_EQ(said("a, 2"), "gives several values");
  EXPECT_EQ(said("a" + std::string(2000, '+') + "1"), "is too long for an expression");
  EXPECT_EQ(said("1/0"), "gives inf, a finite number is needed");
  EXPECT_EQ(said("10^31"), "gives 1e+31, which violates |number| <= 1e+30");
  EXPECT_EQ(said("1e999"), "is not a finite number");
  EXPECT_EQ(said("2 +").substr(0, 22), "is not an expression: ");
  const ExpressionResult unknown = scope.Lookup("aa");
  EXPECT_EQ(unknown.error, "there is no parameter 'aa'");
  EXPECT_EQ(unknown.hint, "did you mean 'a'?");
}

TEST(Expressions, ComparisonsAreNoAssignments) {
  Scope scope;
  scope.Define("a", "2");
  for (const char* text : {"a == 2", "a != 3", "a >= 2", "a <= 2", "a==2 && a>1"}) {
    EXPECT_EQ(scope.Evaluate(text).value, 1.0) << text << ": " << scope.Evaluate(text).error;
  }
}

TEST(Expressions, NumbersAndCallsAreNoNames) {
  Scope scope;
  scope.Define("e", "5");
  scope.Define("E2", "7");
  EXPECT_EQ(scope.Evaluate("1e-3 + 2E+1").value, 20.001) << "not the parameter e";
  EXPECT_EQ(scope.Evaluate("e + E2").value, 12.0);
  EXPECT_TRUE(IsWrittenOut("1e-3"));
  EXPECT_TRUE(IsWrittenOut("sqrt(2)*pi/3"));
  EXPECT_FALSE(IsWrittenOut("sqrt(e)"));
  EXPECT_FALSE(IsWrittenOut("1e-3*e"));
}

TEST(Expressions, ALaterDefinitionReplacesAndASetValueWins) {
  Scope scope;
  scope.Define("a", "1");
  scope.Define("a", "2", kMm);
  scope.Define("b", "a");
  EXPECT_EQ(scope.Lookup("b").value, 0.002);
  Scope inner(&scope);
  inner.Define("c", "nothing");
  inner.Set("c", 3.0);
  EXPECT_EQ(inner.Evaluate("c + b").value, 3.002);
  EXPECT_EQ(inner.Names(), (std::vector<std::string>{"pi", "a", "b", "c"}));
  EXPECT_FALSE(inner.Has("a")) << "of its own level";
}

TEST(Expressions, AFailedOuterParameterIsSilentInside) {
  Scope outer;
  outer.Define("a", "1/0");
  Scope inner(&outer);
  inner.Define("b", "2*a");
  const ExpressionResult result = inner.Lookup("b");
  EXPECT_FALSE(result.value);
  EXPECT_EQ(result.error, "");
  EXPECT_EQ(outer.Lookup("a").error, "gives inf, a finite number is needed");
}

// Of everything that decides, alone and within each other: on its own branch an expression is
// itself, and on a branch that is held it has neither corner nor jump.
TEST(ExpressionBranches, AreTheExpressionWhereTheyHold) {
  Scope scope;
  scope.Define("a", "0.3");
  const std::vector<std::string> texts = {
      "abs(x)",
      "sign(x)*v",
      "min(x, v)",
      "max(0, x - a, v)",
      "rint(4*x)",
      "x < a ? 1 : 2",
      "x <= v ? x : -v^2",
      "x > a",
      "x >= a && v < 0 ? 3 : v > a || x < -a ? 4 : x",
      "x == 2 ? 1 : 0",
      "x != v",
      "2*(x > -1) - 0.03*v",
      "-5*(x - abs(min(x, a))) + (v < 0 ? sqrt(-v) : v*abs(v))",
      "max(abs(x) - a, 0)*(1 + sign(v - (x > 0 ? a : -a)))",
      "(x + (v < x ? a : 1))*2",
  };
  std::mt19937 random(3);
  std::uniform_real_distribution<double> pick(-2.0, 2.0);
  for (const std::string& text : texts) {
    const FormulaResult compiled = scope.Compile(text, {"x", "v"});
    ASSERT_NE(compiled.formula, nullptr) << text << ": " << compiled.error;
    const Formula& formula = *compiled.formula;
    EXPECT_TRUE(formula.has_branches()) << text;
    std::set<int> branches;
    for (int i = 0; i < 300; ++i) {
      const std::array at = {pick(random), pick(random)};
      const int branch = formula.BranchAt(at);
      branches.insert(branch);
      EXPECT_EQ(formula.OnBranch(branch, at), formula.At(at)) << text;
      // Second differences of what is smooth; at a corner of slope 1 they are 1 per step.
      constexpr double h = 1e-3;
      const auto along = [&](double s) {
        return formula.OnBranch(branch, std::array{at[0] + s, at[1] + 0.7 * s});
      };
      for (double s = -1.0; s < 1.0; s += 0.01) {
        if (std::abs(at[1] + 0.7 * s) < 0.05) continue;  // of the root
        const double second = along(s + h) - 2.0 * along(s) + along(s - h);
        if (formula.BranchAt(std::array{at[0] + s, at[1] + 0.7 * s}) != branch &&
            text.find("sqrt") != std::string::npos) {
          continue;  // a root of a negative number gives way to the branch that holds
        }
        EXPECT_LT(std::abs(second), 1e-4) << text << " at " << s;
      }
    }
    if (text.find("==") == std::string::npos && text.find("!=") == std::string::npos) {
      EXPECT_GT(branches.size(), 1u) << text;
    }
  }
}

TEST(ExpressionBranches, OfConstantsAreNone) {
  Scope scope;
  scope.Define("a", "0.3");
  for (const char* text : {"abs(a)*x", "a > 0 ? x : v", "max(a, 1)*sin(x)", "x^2 + v"}) {
    const FormulaResult compiled = scope.Compile(text, {"x", "v"});
    ASSERT_NE(compiled.formula, nullptr) << text << ": " << compiled.error;
    EXPECT_FALSE(compiled.formula->has_branches()) << text;
  }
}

TEST(ExpressionBranches, OfOneDecisionAreTwoHoweverOftenItStands) {
  std::string text = "0";
  for (int i = 0; i < 40; ++i) text += "+abs(x-1)";
  Scope scope;
  const FormulaResult compiled = scope.Compile(text, {"x"});
  ASSERT_NE(compiled.formula, nullptr) << compiled.error;
  EXPECT_EQ(compiled.formula->BranchAt(std::array{0.5}), 0);
  EXPECT_EQ(compiled.formula->BranchAt(std::array{1.5}), 1);
  EXPECT_EQ(compiled.formula->OnBranch(1, std::array{0.5}), -20.0);
}

TEST(ExpressionBranches, AreNotEndless) {
  std::string text = "0";
  for (int i = 0; i < 40; ++i) text += "+abs(x-" + std::to_string(i) + ")";
  Scope scope;
  EXPECT_EQ(scope.Compile(text, {"x"}).error,
            "is not an expression: it decides between too many branches");
}

TEST(Expressions, ParameterNamesAreWordsWithoutAMeaningOfTheirOwn) {
  EXPECT_EQ(InvalidNameReason("theta_1"), "");
  for (const char* name : {"", "1a", "a b", "a.b", "a-b", "ä"}) {
    EXPECT_EQ(InvalidNameReason(name), "a parameter's name is made of letters, digits and _");
  }
  for (const char* name : {"pi", "inf", "NaN"}) {
    EXPECT_EQ(InvalidNameReason(name), "this name has a fixed meaning") << name;
  }
  EXPECT_EQ(InvalidNameReason("sin"), "this is the name of a function");
}

}  // namespace
}  // namespace mbv
