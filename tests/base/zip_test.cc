// ZIP archives: the same bytes from the same files, and nothing believed of what others wrote.
#include "base/zip.h"

#include <gtest/gtest.h>

#include "tests/support/test_folder.h"

namespace mbv {
namespace {

std::string Written(const std::vector<ArchiveEntry>& entries) {
  std::string trouble;
  auto bytes = WriteZip(entries, &trouble);
  EXPECT_TRUE(bytes) << trouble;
  return bytes.value_or("");
}

// All files of an archive; empty after findings.
std::vector<ArchiveEntry> Unpacked(const std::string& bytes, const ArchiveLimits& limits,
                                   Diagnostics* diagnostics) {
  const test::TestFolder folder("zip");
  ZipFile zip(folder.Write("a.zip", bytes), limits, diagnostics);
  EXPECT_EQ(zip.entries().empty(), diagnostics->has_errors());
  std::vector<ArchiveEntry> entries;
  for (const ListedEntry& listed : zip.entries()) {
    ArchiveEntry entry{.path = listed.path, .content = "", .executable = listed.executable};
    const bool read = zip.Read(listed, [&](std::string_view piece) {
      entry.content += piece;
      return true;
    });
    EXPECT_EQ(read, !diagnostics->has_errors());
    if (!read) continue;
    EXPECT_EQ(entry.content.size(), listed.bytes);
    entries.push_back(std::move(entry));
  }
  return entries;
}

// The text of what is found; "" of an archive that is read.
std::string FindingsOf(const std::string& bytes, const ArchiveLimits& limits = {}) {
  Diagnostics diagnostics;
  (void)Unpacked(bytes, limits, &diagnostics);
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
  const std::vector<ArchiveEntry> entries =
      Unpacked(Written({{"p/b", "text\n", true}, {"p/a", zeros}, {"p/c", ""}}), {}, &diagnostics);
  ASSERT_EQ(entries.size(), 3U) << diagnostics.Text();
  EXPECT_EQ(entries[0].path, "p/a");
  EXPECT_EQ(entries[0].content, zeros);
  EXPECT_FALSE(entries[0].executable);
  EXPECT_EQ(entries[1].content, "text\n");
  EXPECT_TRUE(entries[1].executable);
  EXPECT_EQ(entries[2].content, "");
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

// The directory at its end says how much there is to unpack; no more is, whatever it says.
TEST(Zip, MoreThanIsStatedIsNotUnpacked) {
  const std::string size("\x27\x27\0\0", 4), less("\x10\x27\0\0", 4), more("\x50\x27\0\0", 4);
  const std::string bytes = Written({{"p/a", std::string(0x2727, '\0')}});
  EXPECT_EQ(FindingsOf(bytes), "");
  EXPECT_TRUE(
      Says(FindingsOf(Replaced(bytes, size, less)), "'p/a' is longer than the archive says"));
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, size, more)), "'p/a' is damaged: it ends early"));
}

TEST(Zip, TheReaderMayStop) {
  const test::TestFolder folder("zip_stop");
  Diagnostics diagnostics;
  ZipFile zip(folder.Write("a.zip", Written({{"p/a", std::string(1'000'000, 'x')}})), {},
              &diagnostics);
  size_t taken = 0;
  EXPECT_FALSE(zip.Read(zip.entries().at(0), [&](std::string_view piece) {
    taken += piece.size();
    return false;
  }));
  EXPECT_LE(taken, 65536U);
  EXPECT_FALSE(diagnostics.has_errors());
}

// libzip keeps every entry of a directory, of which ZIP64 has any number.
TEST(Zip, TheLargeDirectoryIsRefused) {
  std::string bytes = Written({{"p/a", "1"}});
  bytes.insert(bytes.find("PK\5\6"), "PK\6\7" + std::string(16, '\0'));
  EXPECT_TRUE(Says(FindingsOf(bytes), "is a ZIP64 archive"));
}

TEST(Zip, DamageIsFound) {
  const std::string bytes = Written({{"p/a", "unpacked text"}});
  EXPECT_TRUE(Says(FindingsOf(Replaced(bytes, "unpacked", "unpackEd")), "'p/a' is damaged"));
  EXPECT_TRUE(Says(FindingsOf(bytes.substr(0, bytes.size() / 2)), "is not a ZIP archive"));
  EXPECT_TRUE(Says(FindingsOf(""), "is not a ZIP archive"));
  EXPECT_TRUE(Says(FindingsOf("PK\x03\x04 and no more"), "is not a ZIP archive"));
}

}  // namespace
}  // namespace mbv
