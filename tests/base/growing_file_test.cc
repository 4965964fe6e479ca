// Files that grow over several processes, and texts that come from children in order.
#include "base/files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>

#include "base/worker_pool.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

TEST(GrowingFile, GoesOnBehindWhatIsKept) {
  const test::TestFolder folder("growing");
  const std::string path = folder.PathOf("rows");
  {
    GrowingFile file(path);
    ASSERT_EQ(file.Open(0), "");
    ASSERT_EQ(file.Append("one\ntwo\nthr"), "");
    ASSERT_EQ(file.Finish(), "");
  }
  GrowingFile again(path);
  ASSERT_EQ(again.Open(8), "");
  EXPECT_EQ(again.Append("three\n"), "");
  EXPECT_EQ(ReadWholeFile(path), "one\ntwo\nthree\n");
}

TEST(GrowingFile, SaysWhyItCannotWrite) {
  const test::TestFolder folder("growing_bad");
  EXPECT_NE(GrowingFile(folder.PathOf("no/rows")).Open(0).find("No such file"), std::string::npos);
  const std::string target = folder.Write("target", "x");
  ASSERT_EQ(symlink(target.c_str(), folder.PathOf("link").c_str()), 0);
  EXPECT_NE(GrowingFile(folder.PathOf("link")).Open(0), "");
  EXPECT_EQ(ReadWholeFile(target), "x");
}

// Children that die, hang or are slow leave holes in the right places only.
TEST(StreamFromChildren, GivesTextsInOrderForAnyNumberOfChildren) {
  const auto work = [](size_t i) {
    if (i == 4) raise(SIGKILL);
    if (i == 7) throw 1;
    if (i == 9) sleep(60);
    if (i % 3 == 0) usleep(3000);
    return std::to_string(i * i);
  };
  for (const int parallel : {1, 2, 5, 40}) {
    std::string all;
    StreamFromChildren(14, {.parallel = parallel, .timeout_s = 0.5}, work,
                       [&](size_t i, const std::optional<std::string>& text) {
                         all += std::to_string(i) + ":" + text.value_or("-") + " ";
                         return true;
                       });
    EXPECT_EQ(all, "0:0 1:1 2:4 3:9 4:- 5:25 6:36 7:- 8:64 9:- 10:100 11:121 12:144 13:169 ")
        << parallel;
  }
}

// What was sent together with a death is lost; the children after it lose no other text.
TEST(StreamFromChildren, TextsSentTogetherAreLostWithTheirChildAlone) {
  const auto work = [](size_t i) {
    if (i == 40) raise(SIGKILL);
    return std::to_string(i);
  };
  for (const int parallel : {1, 3}) {
    size_t given = 0, lost = 0;
    bool after = false;
    StreamFromChildren(2000, {.parallel = parallel, .timeout_s = 5.0, .together = true}, work,
                       [&](size_t i, const std::optional<std::string>& text) {
                         (text ? given : lost) += 1;
                         if (text) EXPECT_EQ(*text, std::to_string(i));
                         if (i == 40) EXPECT_FALSE(text);
                         after = after || (i > 40 && !text);
                         return true;
                       });
    EXPECT_EQ(given + lost, 2000u);
    EXPECT_LE(lost, 42u) << parallel;
    EXPECT_FALSE(after) << parallel;
  }
}

TEST(ShareOut, GivesTheSameWithOneJobAndWithMany) {
  const auto shared = [](int jobs) {
    std::string all;
    ShareOut(
        20, jobs, [](size_t i) { return std::to_string(i * i); },
        [&](size_t i, const std::optional<std::string>& text) {
          all += std::to_string(i) + ":" + text.value_or("-") + " ";
        });
    return all;
  };
  EXPECT_EQ(shared(1), shared(3));
  EXPECT_EQ(shared(1), shared(50));
}

// A killed process costs what it was at, and is reported.
TEST(ShareOut, ReportsWhatWasLost) {
  size_t lost = 0, given = 0;
  ShareOut(
      6, 2,
      [](size_t i) {
        if (i == 3) raise(SIGKILL);
        return std::string("x");
      },
      [&](size_t i, const std::optional<std::string>& text) {
        (text ? given : lost) += 1;
        EXPECT_EQ(text.has_value(), i != 3);
      });
  EXPECT_EQ(lost, 1u);
  EXPECT_EQ(given, 5u);
}

TEST(StreamFromChildren, EndsWhenTheReaderCloses) {
  size_t taken = 0;
  StreamFromChildren(
      1000000, {.parallel = 3}, [](size_t) { return std::string(1000, 'x'); },
      [&](size_t, const std::optional<std::string>&) { return ++taken < 5; });
  EXPECT_EQ(taken, 5u);
  StreamFromChildren(
      0, {}, [](size_t) { return std::string(); },
      [](size_t, const std::optional<std::string>&) { return true; });
}

}  // namespace
}  // namespace mbv
