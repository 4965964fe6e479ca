#include "plot/layout.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

TEST(FigureMarkup, ForPangoSymbolsSlantAndIndicesAreSmaller) {
  EXPECT_EQ(ToPango("F < *F*", 10), "F &lt; <i>F</i>");
  EXPECT_EQ(ToPango("*k*_{min}", 10), "<i>k</i><span size=\"7373\" rise=\"-2048\">min</span>");
  EXPECT_EQ(ToPango("10^{−6}", 10), "10<span size=\"7373\" rise=\"3686\">−6</span>");
}

TEST(FigureMarkup, ForTexSpecialCharactersAreEscaped) {
  EXPECT_EQ(ToTex("drive_p & 5 %"), "drive\\_p \\& 5 \\%");
  EXPECT_EQ(ToTex("Δ*F* (N·m)"), "\\ensuremath{\\Delta}\\textit{F} (N\\ensuremath{\\cdot}m)");
  EXPECT_EQ(ToTex("*k*_{a,b}"), "\\textit{k}\\textsubscript{a,b}");
}

TEST(FigureMarkup, VerbatimTextIsNotAMarkup) {
  const std::string name = "a*b_{c}^{d}\\e";
  EXPECT_EQ(ToPango(AsPlainText(name), 8), name);
  EXPECT_NE(ToPango(name, 8), name);
}

}  // namespace
}  // namespace mbv
