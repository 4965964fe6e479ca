#include "image/png.h"

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

}  // namespace
}  // namespace mbv
