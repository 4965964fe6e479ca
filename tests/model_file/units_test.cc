// Units at the end of names, and the numbers that they make.
#include "model_file/yaml/units.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "base/types.h"

namespace mbv {
namespace {

// The number nearest to a decimal.
double NearestTo(const std::string& decimal) {
  double value = kNan;
  std::from_chars(decimal.data(), decimal.data() + decimal.size(), value);
  return value;
}

TEST(Units, MillimetresBecomeTheDecimalThatIsMeant) {
  EXPECT_EQ(kMm.to_si(9), 0.009);
  EXPECT_EQ(fmt::format("{}", kMm.to_si(9)), "0.009") << "9 * 0.001 is 0.009000000000000001";
  EXPECT_EQ(kMm.to_si(4.1), 0.0041) << "4.1 / 1000 is 0.0040999999999999995";
  EXPECT_EQ(kMm.to_si(-201.574), -0.201574);
  EXPECT_EQ(kMm.to_si(1e20), 1e17);
  EXPECT_EQ(kMm.to_si(2.5e-7), 2.5e-10);
  EXPECT_TRUE(std::signbit(kMm.to_si(-0.0)));
}

// Every decimal with up to four digits behind the point, below ten metres, of both signs.
TEST(Units, NoMillimetreIsRoundedTwice) {
  for (int digits = 0; digits <= 4; ++digits) {
    for (int i = 1; i < 10000; ++i) {
      const std::string typed = fmt::format("{}e-{}", i, digits);
      EXPECT_EQ(kMm.to_si(NearestTo(typed)),
                NearestTo(typed.substr(0, typed.find('e')) + "e-" + std::to_string(digits + 3)))
          << typed;
    }
  }
  // And long ones, as computers write them.
  std::mt19937_64 random(20190417);
  for (int i = 0; i < 10000; ++i) {
    const std::string typed = std::to_string(random() % 1'000'000'000'000'000);
    EXPECT_EQ(kMm.to_si(NearestTo(typed)), NearestTo(typed + "e-3")) << typed;
  }
}

TEST(Units, DegreesAreRoundedOnceForThePiOfExpressions) {
  for (int n = 1; n <= 180; ++n) {
    if (180 % n != 0) continue;
    EXPECT_EQ(kDeg.to_si(180.0 / n), std::numbers::pi / n) << "pi/" << n;
    EXPECT_EQ(kDeg.to_si(-180.0 / n), -std::numbers::pi / n) << "pi/" << n;
  }
  // More digits than a double has report what is nearest.
  static_assert(std::numeric_limits<long double>::digits >= 64);
  constexpr double kTwoLongRoundings = 0x1p-9;  // in half steps
  for (int i = 1; i < 36000; ++i) {
    const double degrees = i / 100.0;
    const long double exact = static_cast<long double>(degrees) * std::numbers::pi / 180.0L;
    const double radians = kDeg.to_si(degrees);
    const double half_step = 0.5 * (std::nextafter(radians, 10.0) - radians);
    EXPECT_LE(std::abs(static_cast<double>(exact - radians)), half_step * (1.0 + kTwoLongRoundings))
        << degrees;
  }
}

TEST(Units, WhatIsNotFiniteStaysSo) {
  for (const UnitSuffix& unit : {kPlain, kDeg, kMm}) {
    EXPECT_EQ(unit.to_si(HUGE_VAL), HUGE_VAL);
    EXPECT_EQ(unit.to_si(-HUGE_VAL), -HUGE_VAL);
    EXPECT_TRUE(std::isnan(unit.to_si(kNan)));
    EXPECT_EQ(unit.to_si(0.0), 0.0);
  }
  const double least = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(kMm.to_si(least), 0.0);
  EXPECT_EQ(kMm.to_si(std::numeric_limits<double>::max()), NearestTo("1.7976931348623157e305"));
}

TEST(Units, ANameMayEndInOne) {
  EXPECT_EQ(SplitUnit("l_mm").name, "l");
  EXPECT_EQ(SplitUnit("l_mm").unit.suffix, "_mm");
  EXPECT_EQ(SplitUnit("platform.yaw_deg").name, "platform.yaw");
  EXPECT_EQ(SplitUnit("length").name, "length");
  EXPECT_EQ(SplitUnit("length").unit.suffix, "");
  EXPECT_EQ(SplitUnit("mm").name, "mm");
  EXPECT_EQ(SplitUnit("x_deg_mm").name, "x_deg") << "one unit, the last";
}

TEST(Units, AKnownNameIsNotCut) {
  const auto known = [](const std::string& name) { return name == "gap_mm" || name == "turn"; };
  EXPECT_EQ(SplitUnit("gap_mm", known).name, "gap_mm");
  EXPECT_EQ(SplitUnit("gap_mm", known).unit.suffix, "");
  EXPECT_EQ(SplitUnit("gap_mm_mm", known).name, "gap_mm");
  EXPECT_EQ(SplitUnit("turn_deg", known).unit.suffix, "_deg");
  EXPECT_EQ(SplitUnit("other_deg", known).name, "other_deg") << "as it was given, for messages";
}

TEST(Units, SuitWhatTheyMeasure) {
  EXPECT_TRUE(kMm.Suits("m"));
  EXPECT_FALSE(kMm.Suits("rad"));
  EXPECT_TRUE(kDeg.Suits("rad"));
  EXPECT_FALSE(kDeg.Suits("N"));
  EXPECT_TRUE(kPlain.Suits("N"));
  EXPECT_EQ(InEveryUnit("x"), (std::vector<std::string>{"x", "x_deg", "x_mm"}));
}

}  // namespace
}  // namespace mbv
