#include "base/markup.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mbv {
namespace {

TEST(EscapeMarkup, FiveCharactersBecomeEntitiesAndNothingElseChanges) {
  EXPECT_EQ(EscapeMarkup("a<b & 'c' > \"d\""), "a&lt;b &amp; &#39;c&#39; &gt; &quot;d&quot;");
  EXPECT_EQ(EscapeMarkup("&amp;"), "&amp;amp;");
  EXPECT_EQ(EscapeMarkup("µ → 3\n"), "µ → 3\n");
  EXPECT_EQ(EscapeMarkup(""), "");
}

TEST(RoundingOf, IsHalfADecimalOfTheTypicalNumber) {
  const auto length = [](const char* xml) { return RoundingOf(xml).length; };
  const auto direction = [](const char* xml) { return RoundingOf(xml).direction; };
  EXPECT_DOUBLE_EQ(length("<body pos='0.12345 0 -0.54321'/>"), 0.5e-5);
  EXPECT_DOUBLE_EQ(length("<origin xyz = \"1.2345e-05 0 12.345678\"/>"), 0.5e-9);
  EXPECT_DOUBLE_EQ(length("<a pos='1234.5'/><b pos='0.012345'/><c pos='0.123456789'/>"), 0.5e-6);
  // What computing left of zeros does not count, however often it is there.
  EXPECT_DOUBLE_EQ(length("<a pos='-1.30697e-17 -1.56523e-17 0.0140985'/><b pos='2e-18 -4.4409e-16 "
                          "0.102345'/>"),
                   0.5e-7);
  EXPECT_EQ(length("<a pos='-1.30697e-17 0 0.1'/>"), 0.0);
  // Round numbers are exact, and so are those of no attribute that places something.
  EXPECT_EQ(length("<body pos='0.1 0.25 0' mass='0.12345'/> pos 0.12345"), 0.0);
  EXPECT_EQ(length("<body pos='0.123x45 nan'/>"), 0.0);
  EXPECT_EQ(length("<body pos='0.12345"), 0.0);
  EXPECT_DOUBLE_EQ(direction("<body quat='0.7071 0.7071 0 0'/>"), 0.5e-4);
  EXPECT_DOUBLE_EQ(direction("<body euler='12.34 0 0'/>"), 0.5e-2 * std::acos(-1.0) / 180.0);
  EXPECT_DOUBLE_EQ(direction("<compiler angle='radian'/><body euler='12.34 0 0'/>"), 0.5e-2);
  // SDF writes numbers as text: three lengths, then angles.
  const char* sdf = "<pose relative_to='a'>0.12345 0 1.54321 -3.141 0 0</pose><pose/><pose>";
  EXPECT_DOUBLE_EQ(length(sdf), 0.5e-5);
  EXPECT_DOUBLE_EQ(direction(sdf), 0.5e-3);
}

}  // namespace
}  // namespace mbv
