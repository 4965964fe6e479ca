#include "plot/style.h"

#include <gtest/gtest.h>

#include <numbers>

namespace mbv {
namespace {

TEST(FigureUnits, AreChosenSoThatNumbersAreShort) {
  EXPECT_EQ(UsualUnit("N", 450e3).name, "kN");
  EXPECT_EQ(UsualUnit("N", 450).name, "N");
  EXPECT_EQ(UsualUnit("N m", 3e-3).name, "mN m");
  EXPECT_EQ(UsualUnit("N", 0).name, "N");
  EXPECT_EQ(UsualUnit("rad", 1).name, "deg");
  EXPECT_EQ(UsualUnit("Pa", 1e9).name, "Pa");  // nothing else is known of it
}

TEST(FigureUnits, AreFoundForWhatTheyMeasureOnly) {
  EXPECT_EQ(FindUnit("N", "m"), nullptr);
  EXPECT_DOUBLE_EQ(FindUnit("rad/s", "rpm")->factor * 2 * std::numbers::pi, 60);
  EXPECT_DOUBLE_EQ(FindUnit("N m", "N mm")->factor, 1000);
  EXPECT_EQ(UnitsOf("m"), (std::vector<std::string>{"m", "mm", "um"}));
}

}  // namespace
}  // namespace mbv
