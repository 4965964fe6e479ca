// Single files: replaced whole, and only where a file may be replaced.
#include "base/files.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <thread>

#include "base/inputs.h"
#include "tests/support/kill_at_calls.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

class FilesTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() /
        (std::string("mbv_files_") + testing::UnitTest::GetInstance()->current_test_info()->name() +
         "_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    file_ = folder_ / "file";
  }
  void TearDown() override { fs::remove_all(folder_); }
  [[nodiscard]] size_t Entries() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(folder_), {}));
  }
  fs::path folder_, file_;
};

TEST_F(FilesTest, AreWrittenWholeWithTheirFolders) {
  EXPECT_EQ(WriteFile(folder_ / "a" / "b" / "c", "one"), "");
  EXPECT_EQ(WriteFile(folder_ / "a" / "b" / "c", "two"), "");
  EXPECT_EQ(ReadWholeFile(folder_ / "a" / "b" / "c"), "two");
  EXPECT_EQ(ReadWholeFile(folder_ / "a"), std::nullopt);
  EXPECT_EQ(ReadWholeFile(folder_ / "none"), std::nullopt);
}

TEST_F(FilesTest, KeepTheModeOfTheOldOne) {
  ASSERT_EQ(WriteFile(file_, "one"), "");
  fs::permissions(file_, fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  const fs::perms mode = fs::status(file_).permissions();
  ASSERT_EQ(WriteFile(file_, "two"), "");
  EXPECT_EQ(fs::status(file_).permissions(), mode);
}

// What is not a regular file is opened and written; it is there afterwards as it was.
TEST_F(FilesTest, ThatAreDevicesArePassedThrough) {
  EXPECT_EQ(WriteFile("/dev/null", "gone"), "");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(WriteFile("/dev/full", "x"), "cannot write /dev/full: No space left on device");
}

TEST_F(FilesTest, ThatAreLinksKeepLeadingWhereTheyLead) {
  ASSERT_EQ(WriteFile(folder_ / "there", "one"), "");
  fs::create_symlink("there", file_);
  EXPECT_EQ(WriteFile(file_, "two"), "");
  EXPECT_TRUE(fs::is_symlink(file_));
  EXPECT_EQ(ReadWholeFile(folder_ / "there"), "two");
  fs::create_symlink("not_yet", folder_ / "dangling");
  EXPECT_EQ(WriteFile(folder_ / "dangling", "three"), "");
  EXPECT_EQ(ReadWholeFile(folder_ / "not_yet"), "three");
}

TEST_F(FilesTest, ThatArePipesAreWrittenInto) {
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  std::string text(100'000, 'x'), read_back;
  std::thread reader([&] {
    const int pipe = open(file_.c_str(), O_RDONLY);
    char buffer[4096];
    for (ssize_t n = 1; n > 0;) {
      n = read(pipe, buffer, sizeof buffer);
      if (n > 0) read_back.append(buffer, static_cast<size_t>(n));
    }
    close(pipe);
  });
  EXPECT_EQ(WriteFile(file_, text), "");
  reader.join();
  EXPECT_EQ(read_back, text);
  EXPECT_TRUE(fs::is_fifo(file_));
}

TEST_F(FilesTest, AReaderThatGoesAwayIsAnErrorNotASignal) {
  ASSERT_EQ(mkfifo(file_.c_str(), 0600), 0);
  std::thread reader([&] { close(open(file_.c_str(), O_RDONLY)); });
  EXPECT_NE(WriteFile(file_, std::string(1'000'000, 'x')).find("Broken pipe"), std::string::npos);
  reader.join();
}

TEST_F(FilesTest, AFolderIsNotReplaced) {
  fs::create_directories(file_ / "content");
  EXPECT_EQ(WriteFile(file_, "x"), "cannot write " + file_.string() + ": Is a directory");
  EXPECT_TRUE(fs::exists(file_ / "content"));
}

TEST_F(FilesTest, TheTemporaryFileCannotBeALink) {
  // Names are new at each call.
  std::set<std::string> names;
  for (int i = 0; i < 100; ++i) names.insert(RandomLetters());
  EXPECT_GT(names.size(), 95u);
}

TEST_F(FilesTest, LeftoversOfKilledWritersGo) {
  for (int call = 1; call < 100; ++call) {
    ASSERT_EQ(WriteFile(file_, "old"), "");
    KillAtCalls killer([&] { _exit(WriteFile(file_, "new").empty() ? 0 : 1); });
    const bool ended = killer.EndsBefore(call);
    const auto content = ReadWholeFile(file_);
    EXPECT_TRUE(content == "old" || content == "new") << call;
    ASSERT_EQ(WriteFile(file_, "next"), "");
    EXPECT_EQ(Entries(), 1u) << call;
    if (ended) return;
  }
  FAIL() << "never ended";
}

TEST_F(FilesTest, ManyWritersOfOneFileAllSucceed) {
  std::vector<pid_t> all;
  for (int i = 0; i < 6; ++i) {
    all.push_back(fork());
    if (all.back() != 0) continue;
    bool good = true;
    for (int k = 0; k < 30; ++k) good = WriteFile(file_, std::to_string(i)).empty() && good;
    _exit(good ? 0 : 1);
  }
  for (const pid_t pid : all) {
    int status = 0;
    waitpid(pid, &status, 0);
    EXPECT_EQ(status, 0);
  }
  EXPECT_EQ(Entries(), 1u);
}

TEST_F(FilesTest, BelowAFolderAreFoundThoughSomeCannotBeRead) {
  ASSERT_EQ(WriteFile(folder_ / "a" / "x.yaml", ""), "");
  ASSERT_EQ(WriteFile(folder_ / "b.yaml", ""), "");
  ASSERT_EQ(WriteFile(folder_ / "c.txt", ""), "");
  fs::create_directory_symlink(folder_, folder_ / "a" / "round");
  ASSERT_EQ(mkfifo((folder_ / "pipe.yaml").c_str(), 0600), 0);
  std::vector<std::string> unread;
  const std::vector<std::string> files = {folder_ / "a" / "x.yaml", folder_ / "b.yaml"};
  EXPECT_EQ(FilesBelow(folder_, ".yaml", &unread), files);
  EXPECT_TRUE(unread.empty());
  (void)FilesBelow(folder_ / "none", ".yaml", &unread);
  EXPECT_EQ(unread.size(), 1u);
}

TEST_F(FilesTest, ReadByLoadersAreReportedOnceEach) {
  const InputWatch outer;
  NoteInput("a", "1");
  {
    const InputWatch inner;
    NoteInput("b", "2");
    NoteInput("b", "2");
    EXPECT_EQ(inner.files().size(), 1u);
  }
  NoteInput("a", "1");
  ASSERT_EQ(outer.files().size(), 2u);
  EXPECT_EQ(outer.files()[1].file, "b");
  EXPECT_EQ(outer.files()[1].fingerprint, ContentFingerprint("2"));
  ASSERT_EQ(WriteFile(file_, ""), "");
  fs::create_symlink("file", folder_ / "other_name");
  EXPECT_EQ(SameFile(folder_ / "other_name", {{"none", ""}, {file_, ""}}), file_);
  EXPECT_EQ(SameFile(folder_ / "new", {{file_, ""}}), "");
}

TEST_F(FilesTest, AProgramIsFoundByTheNameThatItWasCalledWith) {
  EXPECT_EQ(ProgramFile(), fs::read_symlink("/proc/self/exe"));
  const fs::path bin = folder_ / "bin", other = folder_ / "other";
  for (const fs::path& folder : {other, bin}) {
    fs::create_directories(folder);
    ASSERT_EQ(WriteFile(folder / "mbv_tool", "#!/bin/sh\n"), "");
  }
  fs::permissions(bin / "mbv_tool", fs::perms::owner_all);
  const std::string before = std::getenv("PATH") != nullptr ? std::getenv("PATH") : "";
  // What cannot be run is passed over, as a shell does.
  setenv("PATH", (other.string() + "::" + bin.string()).c_str(), 1);
  EXPECT_EQ(ProgramCalled("mbv_tool"), fs::canonical(bin / "mbv_tool"));
  EXPECT_EQ(ProgramCalled("mbv_no_tool"), fs::path());
  setenv("PATH", before.c_str(), 1);
  EXPECT_EQ(ProgramCalled((bin / ".." / "bin" / "mbv_tool").string()),
            fs::canonical(bin / "mbv_tool"));
}

}  // namespace
}  // namespace mbv
