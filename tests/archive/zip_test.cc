// ZIP archives: the same bytes from the same files, and nothing believed of what others wrote.
#include "archive/zip.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

std::string Written(const std::vector<ArchiveEntry>& entries) {
  std::string trouble;
  auto bytes = WriteZip(entries, &trouble);
  EXPECT_TRUE(bytes) << trouble;
  return bytes.value_or("");
}

// The text of what is found; "" of an archive that is read.
std::string FindingsOf(const std::string& bytes, const ArchiveLimits& limits = {}) {
  Diagnostics diagnostics;
  const auto entries = ReadZip(bytes, "a.zip", limits, &diagnostics);
  EXPECT_EQ(entries.has_value(), !diagnostics.has_errors());
  return diagnostics.Text();
}

std::string Replaced(std::string bytes, const std::string& what, const std::string& by) {
  size_t count = 0;
  for (size_t at = bytes.find(what); at != std::string::npos; at = bytes.find(what, at)) {
    bytes.replace(at, what.size(), by), at += by.size(), ++count;
  }
  EXPECT_GT(count, 0U) << what;
  return bytes;
}

bool Says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

TEST(Zip, GivesBackWhatWasWritten) {
  const std::string zeros(100'000, '\0');
  Diagnostics diagnostics;
  const auto entries = ReadZip(Written({{"p/b", "text\n", true}, {"p/a", zeros}, {"p/c", ""}}),
                               "a.zip", {}, &diagnostics);
  ASSERT_TRUE(entries) << diagnostics.Text();
  ASSERT_EQ(entries->size(), 3U);
  EXPECT_EQ((*entries)[0].path, "p/a");
  EXPECT_EQ((*entries)[0].content, zeros);
  EXPECT_FALSE((*entries)[0].executable);
  EXPECT_EQ((*entries)[1].content, "text\n");
  EXPECT_TRUE((*entries)[1].executable);
  EXPECT_EQ((*entries)[2].content, "");
}

TEST(Zip, TheOrderOfFilesAndTheZoneOfTimeChangeNoByte) {
  const std::string bytes = Written({{"p/b", "2"}, {"p/a", "1"}});
  setenv("TZ", "Asia/Tokyo", 1);
  EXPECT_EQ(Written({{"p/a", "1"}, {"p/b", "2"}}), bytes);
  unsetenv("TZ");
}

TEST(Zip, PathsThatLeadOutsideAreFound) {
  const std::string bytes = Written({{"xx/evil", "1"}, {"yy/good", "1"}});
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, "xx/evil", "../evil")), "'../evil' leads outside"));
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, "xx/evil", "/x/evil")), "'/x/evil' leads outside"));
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, "xx/evil", "xx\\evil")), "leads outside"));
  // All at once.
  const std::string both = Replaced(Replaced(bytes, "xx/evil", "../evil"), "yy/good", "y/../no");
  EXPECT_TRUE(Says(FindingsOf(both), "../evil") && Says(FindingsOf(both), "y/../no"));
}

TEST(Zip, LinksAndDevicesAreFound) {
  const std::string bytes = Written({{"p/a", "/etc/passwd"}});
  const std::string mode("\xa4\x81", 2);  // a plain file, 0644
  EXPECT_EQ(FindingsOf(bytes), "");
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, mode, "\xff\xa1")), "'p/a' is a link"));
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, mode, "\xa4\x61")), "'p/a' is a device"));
}

TEST(Zip, TwoFilesOfOnePathAreFound) {
  const std::string bytes = Written({{"p/a1", "1"}, {"p/a2", "2"}});
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, "p/a2", "p/a1")), "holds 'p/a1' twice"));
  const std::string nested = Written({{"p/a/b", "1"}, {"p/c", "2"}});
  EXPECT_TRUE(Says(FindingsOf(Replaced(nested, "p/c", "p/a")), "'p/a' is a file and the folder"));
}

TEST(Zip, BombsEndAtTheLimit) {
  const std::string bytes =
      Written({{"p/a", std::string(600'000, '\0')}, {"p/b", std::string(600'000, '\0')}});
  EXPECT_LT(bytes.size(), 5000U);
  EXPECT_EQ(FindingsOf(bytes, {.bytes = 1'200'000}), "");
  EXPECT_TRUE(Says(FindingsOf(bytes, {.bytes = 1'199'999}), "unpacks to more than 1 MB"));
  EXPECT_TRUE(Says(FindingsOf(bytes, {.entries = 1}), "holds 2 files, more than 1"));
}

TEST(Zip, DamageIsFound) {
  const std::string bytes = Written({{"p/a", "unpacked text"}});
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, "unpacked", "unpackEd")), "'p/a' is damaged"));
  EXPECT_TRUE(Says(FindingsOf(bytes.substr(0, bytes.size() / 2)), "is no ZIP archive"));
  EXPECT_TRUE(Says(FindingsOf(""), "is no ZIP archive"));
  EXPECT_TRUE(Says(FindingsOf("PK\x03\x04 and no more"), "is no ZIP archive"));
}

}  // namespace
}  // namespace mbv
