// Numbers of scenario files: expressions, rules, units, and what is said when they do not fit.
#include "model_file/yaml/value_reader.h"

#include <gtest/gtest.h>

#include <numbers>

namespace mbv {
namespace {

// A text, with parameters L = 2 and bad (which has failed).
class Values : public testing::Test {
 protected:
  void Read(const std::string& text) {
    root_ = yaml_.Parse(text);
    ASSERT_TRUE(root_) << yaml_.diagnostics().Text();
    scope_.Set("L", 2.0);
    scope_.Define("bad", "1/0");
    (void)scope_.Lookup("bad");
  }
  [[nodiscard]] const YamlNode& At(const char* key) const { return *root_->Find(key); }
  [[nodiscard]] YamlMap Map(const std::vector<std::string>& keys) {
    return {&yaml_, root_.get(), "", keys};
  }
  [[nodiscard]] std::string Reported() const { return yaml_.diagnostics().Text(); }

  YamlReader yaml_{"s.yaml"};
  Scope scope_;
  ValueReader values_{&yaml_, &scope_};
  YamlNodePtr root_;
};

TEST_F(Values, ANumberIsAnExpressionOfParameters) {
  Read("a: 3*L + 1\nb: [1]\nc: 3*M\nd: 2*bad\n");
  EXPECT_EQ(values_.Number(At("a"), "a"), 7.0);
  EXPECT_FALSE(values_.Number(At("b"), "b"));
  EXPECT_FALSE(values_.Number(At("c"), "c"));
  EXPECT_EQ(Reported(),
            "s.yaml:2:4: error: b is a list of 1, a number is needed\n"
            "s.yaml:3:4: error: c = '3*M' has the unknown symbol 'M'\n"
            "  hint: did you mean 'L'?\n");
  EXPECT_FALSE(values_.Number(At("d"), "d"));
}

TEST_F(Values, APositiveNumberIsNotZero) {
  Read("a: L\nb: L - 2\nc: -1e-300\n");
  EXPECT_EQ(values_.Positive(At("a"), "a"), 2.0);
  EXPECT_FALSE(values_.Positive(At("b"), "b"));
  EXPECT_FALSE(values_.Positive(At("c"), "c"));
  EXPECT_EQ(Reported(),
            "s.yaml:2:4: error: b = 0 violates b > 0\n"
            "s.yaml:3:4: error: c = -1e-300 violates c > 0\n");
}

TEST_F(Values, AListIsWholeOrNotAtAllAndEveryBadItemIsReported) {
  Read("good: [1, L, pi]\nbad: [width, 2, [3]]\nshort: [1, 2]\n");
  EXPECT_EQ(values_.Numbers(At("good"), "good"), (std::vector<double>{1.0, 2.0, std::numbers::pi}));
  EXPECT_EQ(values_.Vector(At("good"), "good"), Vec3(1.0, 2.0, std::numbers::pi));
  EXPECT_FALSE(values_.Numbers(At("bad"), "bad"));
  EXPECT_FALSE(values_.Vector(At("short"), "short"));
  EXPECT_EQ(Reported(),
            "s.yaml:2:7: error: bad[0] = 'width' has the unknown symbol 'width'\n"
            "s.yaml:2:17: error: bad[2] is a list of 1, a number is needed\n"
            "s.yaml:3:8: error: short is a list of 2, a list of 3 is needed\n");
}

TEST_F(Values, AUnitIsThatOfTheKey) {
  Read("turn_deg: 45*L\ngap_mm: 9\nboth: 1\nboth_mm: 1\nbad_deg: [1]\n");
  const YamlMap map = Map({"turn", "turn_deg", "gap_mm", "both", "both_mm", "bad_deg"});
  EXPECT_EQ(values_.InUnit(map, "turn", {kPlain, kDeg}), std::numbers::pi / 2.0);
  EXPECT_EQ(values_.InUnit(map, "gap", {kPlain, kMm}), 0.009);
  EXPECT_FALSE(values_.InUnit(map, "gap", {kPlain})) << "a unit that this key may not have";
  EXPECT_FALSE(values_.InUnit(map, "none", {kPlain, kDeg, kMm}));
  EXPECT_EQ(Reported(), "");
  EXPECT_EQ(values_.InUnit(map, "both", {kPlain, kMm}), 1.0);
  EXPECT_FALSE(values_.InUnit(map, "bad", {kDeg}));
  EXPECT_EQ(Reported(),
            "s.yaml:4:10: error: both and both_mm are both given\n  hint: keep one of them\n"
            "s.yaml:5:10: error: bad_deg is a list of 1, a number is needed\n");
}

TEST_F(Values, WhatIsRequiredIsMissed) {
  Read("a: 1\nb:\n");
  const YamlMap map = Map({"a", "b", "c"});
  EXPECT_EQ(values_.RequiredPositive(map, "a"), 1.0);
  EXPECT_FALSE(values_.RequiredPositive(map, "b")) << "a key without value";
  EXPECT_FALSE(values_.RequiredPositive(map, "c"));
  EXPECT_EQ(Reported(),
            "s.yaml:1:1: error: the file: 'b' is missing\n"
            "s.yaml:1:1: error: the file: 'c' is missing\n");
}

TEST_F(Values, OverridesAreThoseThatAreNumbers) {
  Read("p: {m: 2*L, n: two, o: {}}\nq: [1]\nr:\n");
  EXPECT_EQ(ReadOverrides(&values_, &At("p"), "p"), (Overrides{{"m", 4.0}}));
  EXPECT_TRUE(ReadOverrides(&values_, &At("q"), "q").empty());
  EXPECT_TRUE(ReadOverrides(&values_, &At("r"), "r").empty());
  EXPECT_TRUE(ReadOverrides(&values_, nullptr, "s").empty());
  EXPECT_EQ(Reported(),
            "s.yaml:1:16: error: p.n = 'two' has the unknown symbol 'two'\n"
            "s.yaml:1:24: error: p.o is a map, a number is needed\n"
            "s.yaml:2:4: error: q is a list of 1, a map of names is needed\n");
}

}  // namespace
}  // namespace mbv
