#include "features/pictures/video.h"

#include <gtest/gtest.h>

#include "render/render.h"

namespace mbv {
namespace {

std::string Png(unsigned char shade) {
  Picture picture{.width = 4, .height = 3, .rgb = std::vector<std::uint8_t>(36, shade)};
  return EncodePng(picture);
}

size_t Count(const std::string& text, const std::string& word) {
  size_t count = 0;
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
  return count;
}

std::vector<PictureFile> ThreePictures() {
  std::vector<PictureFile> pictures(3);
  for (size_t i = 0; i < 3; ++i) pictures[i].content = Png(static_cast<unsigned char>(100 * i));
  return pictures;
}

TEST(AnimatedPng, HoldsEveryFrameOnceAndStaysAValidStillPicture) {
  const std::string video = AnimatedPng(ThreePictures(), 25.0);
  EXPECT_EQ(video.substr(0, 8), Png(0).substr(0, 8));
  EXPECT_EQ(Count(video, "acTL"), 1u);
  EXPECT_EQ(Count(video, "fcTL"), 3u);
  EXPECT_EQ(Count(video, "fdAT"), 2u);
  EXPECT_EQ(Count(video, "IDAT"), Count(Png(0), "IDAT"));
  // The image data of the first frame is that of the still picture, check sum included.
  const std::string still = Png(0);
  const std::string idat =
      still.substr(still.find("IDAT") - 4, still.find("IEND") - still.find("IDAT"));
  EXPECT_NE(video.find(idat), std::string::npos);
}

}  // namespace
}  // namespace mbv
