#include "render/painter.h"

#include <gtest/gtest.h>

namespace mbv::render {
namespace {

std::vector<std::uint8_t> Grey(int pixels, std::uint8_t value) {
  return std::vector<std::uint8_t>(4UL * pixels, value);
}

TEST(Accumulation, MarksWhatDiffersAndItsNeighbours) {
  Accumulation sum(5, 4);
  std::vector<std::uint8_t> first = Grey(20, 100), second = first;
  second[4 * (1 * 5 + 1)] = 112;  // beyond the smallest steps
  second[4 * (3 * 5 + 4)] = 104;  // within them
  sum.Add(first, false);
  sum.Add(second, false);
  EXPECT_EQ(sum.Mark(), 9U);
  EXPECT_EQ(sum.mask()[0], 255);
  EXPECT_EQ(sum.mask()[2 * 5 + 2], 255);
  EXPECT_EQ(sum.mask()[3], 0);
  EXPECT_EQ(sum.mask()[19], 0);
}

TEST(Accumulation, TakesTheMeanOfTheOnesThatCount) {
  Accumulation sum(5, 1);
  std::vector<std::uint8_t> first = Grey(5, 10), second = first;
  second[0] = 40;
  sum.Add(first, false);
  sum.Add(second, false);
  ASSERT_EQ(sum.Mark(), 2U);
  sum.Add(Grey(5, 100), true);  // an unmarked pixel does not take it
  sum.Close();
  EXPECT_EQ(sum.Mean(0, 0), 50);
  EXPECT_EQ(sum.Mean(1, 0), 40);
  EXPECT_EQ(sum.Mean(4, 0), 10);
}

TEST(Accumulation, DividesByTheMeanOpacity) {
  Accumulation sum(1, 1);
  sum.Add({120, 60, 0, 255}, false);
  sum.Add({0, 0, 0, 0}, false);
  sum.Close();
  EXPECT_EQ(sum.Mean(0, 3), 128);
  EXPECT_EQ(sum.Unmultiplied(0, 0), 120);
  EXPECT_EQ(sum.Unmultiplied(0, 1), 60);
  Accumulation none(1, 1);
  none.Add({0, 0, 0, 0}, false);
  none.Close();
  EXPECT_EQ(none.Unmultiplied(0, 0), 0);
}

}  // namespace
}  // namespace mbv::render
