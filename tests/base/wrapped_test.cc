#include "base/text.h"

#include <gtest/gtest.h>

#include <sstream>

namespace mbv {
namespace {

TEST(Wrapped, LeavesShortLinesAndNoLimitAlone) {
  EXPECT_EQ(Wrapped("a b\n\nc d\n", 20), "a b\n\nc d\n");
  EXPECT_EQ(Wrapped(std::string(300, 'x') + " y", 0), std::string(300, 'x') + " y");
}

TEST(Wrapped, ContinuesUnderTheSecondColumnOrIndentedByFour) {
  EXPECT_EQ(Wrapped("  --out TEXT    folder for all of the results\n", 32),
            "  --out TEXT    folder for all\n"
            "                of the results\n");
  EXPECT_EQ(Wrapped("  one two three four five", 14),
            "  one two\n      three\n      four\n      five");
}

TEST(Wrapped, KeepsWordsThatAreLongerThanTheLine) {
  EXPECT_EQ(Wrapped("see /a/very/long/path/indeed now", 12),
            "see /a/very/long/path/indeed\n    now");
}

TEST(Wrapped, CountsCharactersAndNotEscapeSequencesOrBytes) {
  EXPECT_EQ(PrintedWidth("\x1b[1;31mπ ≈ 3\x1b[0m"), 5u);
  EXPECT_EQ(Wrapped("\x1b[32mäöü äöü\x1b[0m", 7), "\x1b[32mäöü äöü\x1b[0m");
  EXPECT_EQ(Wrapped("\x1b[32mäöü äöü\x1b[0m", 6), "\x1b[32mäöü\n   äöü\x1b[0m");
}

TEST(Wrapped, NeverWritesALongerLineThanItsLongestWordNeeds) {
  std::string text;
  for (int i = 0; i < 200; ++i) text += std::string(static_cast<size_t>(i * 7 % 11 + 1), 'w') + " ";
  for (const size_t width : {20u, 33u, 80u}) {
    std::istringstream lines(Wrapped("   " + text, width));
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), width) << line;
  }
}

}  // namespace
}  // namespace mbv
