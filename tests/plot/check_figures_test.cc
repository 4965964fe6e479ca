#include "plot/figure.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

TEST(FigurePatterns, AStarStandsForAnyCharacters) {
  EXPECT_TRUE(FitsPattern("limb1.drive.force", "limb1.drive.force"));
  EXPECT_TRUE(FitsPattern("limb1.drive.force", "limb*.force"));
  EXPECT_TRUE(FitsPattern("limb1.drive.force", "*"));
  EXPECT_TRUE(FitsPattern("a.force.force", "*.force"));
  EXPECT_TRUE(FitsPattern("d1", "d1*"));
  EXPECT_FALSE(FitsPattern("limb1.drive.force", "limb1"));
  EXPECT_FALSE(FitsPattern("limb1.drive.force", "limb*.position"));
  EXPECT_FALSE(FitsPattern("d1.force", "d1.force.*"));
  EXPECT_FALSE(FitsPattern("", "a"));
}

}  // namespace
}  // namespace mbv
