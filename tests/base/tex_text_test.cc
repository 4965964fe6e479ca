#include "base/markup.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

TEST(TexText, NothingOfATextIsACommand) {
  EXPECT_EQ(TexText("\\input{x}"), "\\textbackslash{}input\\{x\\}");
  EXPECT_EQ(TexText("drive_p & 5 %"), "drive\\_p \\& 5 \\%");
  EXPECT_EQ(TexText("$#~^"), "\\$\\#\\textasciitilde{}\\textasciicircum{}");
  EXPECT_EQ(TexText("a\nb"), "a b");
}

TEST(TexText, SignsThatFontsLackAreMathematics) {
  EXPECT_EQ(TexText("κ < 3°"), "\\ensuremath{\\kappa} \\ensuremath{<} 3\\ensuremath{^{\\circ}}");
  EXPECT_EQ(TexText("kg m²"), "kg m\\ensuremath{^{2}}");
  EXPECT_EQ(TexText("′"), "\\ensuremath{'}");
}

TEST(TexText, OtherLettersStay) { EXPECT_EQ(TexText("驱动力 ñ"), "驱动力 ñ"); }

}  // namespace
}  // namespace mbv
