#include "mechanism/named_places.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace mbv {
namespace {

using Rgba = std::array<double, 4>;

TEST(ShapeColor, KnowsNamesAndHexAndMakesTheRestGrey) {
  EXPECT_EQ(ShapeColor("#ff8000"), (Rgba{1.0, 128 / 255.0, 0.0, 1.0}));
  EXPECT_EQ(ShapeColor("#00000080"), (Rgba{0.0, 0.0, 0.0, 128 / 255.0}));
  EXPECT_EQ(ShapeColor("grey"), (Rgba{0.58, 0.6, 0.62, 1.0}));
  EXPECT_NE(ShapeColor("steel"), ShapeColor("grey"));
  for (const char* wrong : {"no such colour", "", "#12345", "#gg0000", "ff8000", "#ff80001"}) {
    EXPECT_EQ(ShapeColor(wrong), ShapeColor("grey")) << wrong;
    EXPECT_FALSE(IsShapeColor(wrong)) << wrong;
  }
}

TEST(ShapeColor, ListsWhatItKnows) {
  const std::vector<std::string> names = ShapeColorNames();
  EXPECT_GT(names.size(), 20U);
  EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
  for (const std::string& name : names) EXPECT_TRUE(IsShapeColor(name)) << name;
}

}  // namespace
}  // namespace mbv
