#include "plot/svg.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

TEST(Svg, AttributesStandInTheirOrderAndAreEscaped) {
  EXPECT_EQ(SvgShape("rect", {{"x", 1.25, 1}, {"y", "2 < 3 & \"4\""}, {"width", 720.0}}),
            "<rect x=\"1.2\" y=\"2 &lt; 3 &amp; &quot;4&quot;\" width=\"720\"/>");
  EXPECT_EQ(SvgShape("g", {}), "<g/>");
}

TEST(Svg, NumbersHaveTheDecimalsAskedFor) {
  EXPECT_EQ(SvgAttribute("x", 2.0 / 3.0, 2).value, "0.67");
  EXPECT_EQ(SvgAttribute("x", -3.0, 0).value, "-3");
  EXPECT_EQ(SvgAttribute("x", 2.5).value, "2.5");
}

TEST(Svg, TextsAreEscapedAndContentsAreNot) {
  EXPECT_EQ(SvgText({{"x", "1"}}, "a < b"), "<text x=\"1\">a &lt; b</text>");
  EXPECT_EQ(SvgElement("g", {{"id", "a"}}, SvgShape("path", {{"d", "M0 0"}})),
            "<g id=\"a\"><path d=\"M0 0\"/></g>");
  EXPECT_EQ(SvgText({}, ""), "<text></text>");
}

}  // namespace
}  // namespace mbv
