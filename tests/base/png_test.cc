#include "base/png.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

Picture Gradient(int width, int height) {
  Picture picture{.width = width, .height = height};
  for (int k = 0; k < 3 * width * height; ++k) {
    picture.rgb.push_back(static_cast<std::uint8_t>((7 * k) % 256));
  }
  return picture;
}

TEST(Png, DecodingUndoesEncoding) {
  const Picture picture = Gradient(5, 3);
  Picture back;
  ASSERT_TRUE(DecodePng(EncodePng(picture), 15, &back));
  EXPECT_EQ(back.width, 5);
  EXPECT_EQ(back.height, 3);
  EXPECT_EQ(back.rgb, picture.rgb);
}

TEST(Png, APictureWithMorePixelsThanAskedForIsNotDecoded) {
  Picture back;
  EXPECT_FALSE(DecodePng(EncodePng(Gradient(5, 3)), 14, &back));
  EXPECT_TRUE(back.rgb.empty());
}

TEST(Png, WhatIsCutOffOrNoPictureIsNotDecoded) {
  const std::string png = EncodePng(Gradient(40, 30));
  Picture back;
  EXPECT_FALSE(DecodePng("no picture", 1000, &back));
  EXPECT_FALSE(DecodePng("", 1000, &back));
  EXPECT_FALSE(DecodePng(png.substr(0, png.size() / 2), 10000, &back));
}

TEST(Png, APictureWithoutItsPixelsIsOurBug) {
  Picture picture = Gradient(5, 3);
  picture.rgb.pop_back();
  EXPECT_ANY_THROW((void)EncodePng(picture));
}

TEST(Png, KeepsOpacitiesAndIsReadAsItLooksOnWhite) {
  const Picture glass{
      .width = 3, .height = 1, .rgb = {255, 0, 0, 255, 0, 0, 10, 20, 30}, .alpha = {255, 51, 0}};
  const std::string png = EncodePng(glass);
  EXPECT_EQ(png.at(25), 6);  // RGBA
  const std::vector<std::uint8_t> seen = {255, 0, 0, 255, 204, 204, 255, 255, 255};
  EXPECT_EQ(OnWhite(glass).rgb, seen);
  EXPECT_TRUE(OnWhite(glass).alpha.empty());
  Picture read;
  ASSERT_TRUE(DecodePng(png, 10, &read));
  for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_NEAR(read.rgb[i], seen[i], 1) << i;
}

}  // namespace
}  // namespace mbv
