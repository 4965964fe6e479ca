#include "plot/text_mask.h"

#include <gtest/gtest.h>

#include <numeric>

namespace mbv {
namespace {

int Cover(const TextMask& mask) {
  return std::accumulate(mask.coverage.begin(), mask.coverage.end(), 0);
}

TEST(TextMask, IsAsWideAsItSaysAndAsHighAsALine) {
  const TextMask mask = DrawText("Stewart", 40.0);
  EXPECT_EQ(mask.coverage.size(), static_cast<size_t>(mask.width) * mask.height);
  EXPECT_NEAR(mask.width, TextWidth("Stewart", 40.0), 3.0);
  EXPECT_GT(Cover(mask), 255 * 200);
  EXPECT_NEAR(TextWidth("Stewart", 80.0), 2.0 * TextWidth("Stewart", 40.0), 1.0);
  // No letter touches the upper or the lower edge.
  for (const char* text : {"ÄÖÜ", "gjpqy"}) {
    const TextMask tall = DrawText(text, 40.0);
    for (int x = 0; x < tall.width; ++x) {
      EXPECT_EQ(tall.coverage[x], 0) << text;
      EXPECT_EQ(tall.coverage[static_cast<size_t>(tall.height - 1) * tall.width + x], 0) << text;
    }
  }
}

TEST(TextMask, DistinguishesCharactersAndTakesNoMarkup) {
  EXPECT_NE(DrawText("5°", 30.0).coverage, DrawText("5?", 30.0).coverage);
  EXPECT_NE(DrawText("m²", 30.0).coverage, DrawText("m2", 30.0).coverage);
  EXPECT_GT(TextWidth("<b>x</b> & y", 30.0), TextWidth("x & y", 30.0) + 50.0);
}

TEST(FittedText, ShortensByWholeCharacters) {
  const double room = 100.0;
  EXPECT_EQ(FittedText("short", 12.0, room), "short");
  const std::string fitted = FittedText("µµµµµµµµµµµµµµµµµµµµµµµµµµµµ", 12.0, room);
  EXPECT_LE(TextWidth(fitted, 12.0), room);
  EXPECT_TRUE(fitted.ends_with("µ…")) << fitted;
  EXPECT_EQ(FittedText("anything", 12.0, 1.0), "");
}

}  // namespace
}  // namespace mbv
