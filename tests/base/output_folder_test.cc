// Results appear whole or not at all, and nothing else in their folders is touched.
#include "base/output_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "base/files.h"
#include "tests/support/kill_at_calls.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

class OutputFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    root_ =
        fs::temp_directory_path() /
        (std::string("mbv_out_") + testing::UnitTest::GetInstance()->current_test_info()->name() +
         "_" + std::to_string(getpid()));
    fs::remove_all(root_);
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  static std::string Read(const fs::path& path) {
    return ReadWholeFile(path).value_or("(no such file)");
  }
  static void Put(const fs::path& path, const std::string& content) {
    ASSERT_EQ(WriteFile(path, content), "");
  }
  // A result of two files and a picture.
  static std::string TryResult(const fs::path& root, const std::string& name,
                               const std::string& content) {
    OutputFolder folder(root, name);
    std::string trouble = folder.Create();
    for (const char* file : {"snapshots/a.png", "traces.csv", "summary.json"}) {
      if (trouble.empty()) trouble = folder.Write(file, content);
    }
    return trouble.empty() ? folder.Commit() : trouble;
  }
  void WriteResult(const std::string& name, const std::string& content) const {
    ASSERT_EQ(TryResult(root_, name, content), "");
  }
  // Names in the root, hidden ones included.
  [[nodiscard]] size_t Entries() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(root_), {}));
  }

  fs::path root_;
};

TEST_F(OutputFolderTest, AppearsOnCommit) {
  OutputFolder folder(root_, "case");
  ASSERT_EQ(folder.Create(), "");
  ASSERT_EQ(folder.Write("snapshots/a.png", "x"), "");
  EXPECT_FALSE(fs::exists(root_ / "case"));
  ASSERT_EQ(folder.Write("summary.json", "{}"), "");
  ASSERT_EQ(folder.Commit(), "");
  EXPECT_EQ(Read(root_ / "case" / "snapshots" / "a.png"), "x");
  const std::set<std::string> files = {kFileList, "snapshots/a.png", "summary.json"};
  EXPECT_EQ(ReadFileList(root_ / "case"), files);
}

TEST_F(OutputFolderTest, ReplacesWhatItWroteAsAWhole) {
  {
    OutputFolder folder(root_, "case");
    ASSERT_EQ(folder.Create(), "");
    ASSERT_EQ(folder.Write("model.xml", "old"), "");
    ASSERT_EQ(folder.Commit(), "");
  }
  WriteResult("case", "new");
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "new");
  EXPECT_FALSE(fs::exists(root_ / "case" / "model.xml")) << "of the old result only";
  EXPECT_EQ(Entries(), 1u);
}

TEST_F(OutputFolderTest, WithoutCommitTheOldResultStays) {
  WriteResult("case", "old");
  {
    OutputFolder interrupted(root_, "case");
    ASSERT_EQ(interrupted.Create(), "");
    ASSERT_EQ(interrupted.Write("summary.json", "half"), "");
  }
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "old");
  EXPECT_EQ(Entries(), 1u);
}

TEST_F(OutputFolderTest, FilesOfTheUserStayWhereTheyAre) {
  WriteResult("case", "old");
  const fs::path folder = root_ / "case";
  Put(folder / "notes.txt", "look at 3 s");
  Put(folder / "snapshots" / "photo.jpg", "of the rig");
  Put(folder / "rig" / "deep" / "log.csv", "1,2");
  fs::create_directories(folder / "empty");
  fs::create_symlink("notes.txt", folder / "link");
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  fs::permissions(folder / "rig", fs::perms::owner_all);
  struct stat before {
  }, after{};
  ASSERT_EQ(stat((folder / "notes.txt").c_str(), &before), 0);
  for (int regression = 0; regression < 3; ++regression) WriteResult("case", "new");
  EXPECT_EQ(Read(folder / "summary.json"), "new");
  EXPECT_EQ(Read(folder / "notes.txt"), "look at 3 s");
  EXPECT_EQ(Read(folder / "snapshots" / "photo.jpg"), "of the rig");
  EXPECT_EQ(Read(folder / "rig" / "deep" / "log.csv"), "1,2");
  EXPECT_TRUE(fs::is_directory(folder / "empty"));
  EXPECT_EQ(fs::read_symlink(folder / "link"), "notes.txt");
  EXPECT_TRUE(fs::is_fifo(folder / "pipe"));
  EXPECT_EQ(fs::status(folder / "rig").permissions(), fs::perms::owner_all);
  ASSERT_EQ(stat((folder / "notes.txt").c_str(), &after), 0);
  EXPECT_EQ(before.st_ino, after.st_ino) << "the same file, not a copy";
  EXPECT_EQ(after.st_nlink, 1u);
  EXPECT_EQ(Entries(), 1u);
}

TEST_F(OutputFolderTest, OneResultInTheFolderOfAnotherLivesInEitherOrder) {
  for (const auto& [first, second] :
       {std::pair{"turn", "turn/fast"}, std::pair{"spin/fast", "spin"}}) {
    for (const char* content : {"old", "new"}) {
      WriteResult(first, content);
      WriteResult(second, content);
    }
    WriteResult(first, "newer");
    EXPECT_EQ(Read(root_ / first / "summary.json"), "newer");
    EXPECT_EQ(Read(root_ / second / "summary.json"), "new");
  }
}

TEST_F(OutputFolderTest, AFileOfTheUserWithANameThatIsNeededIsRefusedByName) {
  Put(root_ / "case" / "traces.csv", "measured on the rig");
  EXPECT_EQ(TryResult(root_, "case", "x"),
            "cannot replace " + (root_ / "case").string() +
                ": it holds traces.csv, which mbverify did not write: move it away");
  EXPECT_EQ(Read(root_ / "case" / "traces.csv"), "measured on the rig");
  EXPECT_FALSE(fs::exists(root_ / "case" / "summary.json"));
  // A folder where a file is needed, and a file where a folder is needed.
  Put(root_ / "a" / "summary.json" / "mine", "x");
  EXPECT_NE(TryResult(root_, "a", "x").find("summary.json"), std::string::npos);
  Put(root_ / "b" / "snapshots", "x");
  EXPECT_NE(TryResult(root_, "b", "x").find("it holds snapshots"), std::string::npos);
  Put(root_ / "c", "x");
  EXPECT_NE(TryResult(root_, "c", "x").find("it is not a folder"), std::string::npos);
  EXPECT_EQ(Entries(), 4u);
}

TEST_F(OutputFolderTest, ResultsWithoutAListAreReplacedByWhatTheirSummarySays) {
  Put(root_ / "case" / "summary.json", "{\n  \"schema\": \"mbverify.summary/1\"}");
  Put(root_ / "case" / "traces.csv", "old");
  Put(root_ / "case" / "notes.txt", "mine");
  WriteResult("case", "new");
  EXPECT_EQ(Read(root_ / "case" / "traces.csv"), "new");
  EXPECT_EQ(Read(root_ / "case" / "notes.txt"), "mine");
}

TEST_F(OutputFolderTest, NamesThatLeadElsewhereAreRefused) {
  Put(root_ / "victim" / "summary.json", "{}");
  fs::create_directories(root_ / "out");
  for (const std::string& name :
       {std::string("../victim"), std::string("a/../../victim"), (root_ / "victim").string(),
        std::string(".."), std::string(), std::string("a//b"), std::string("a/"),
        std::string(".hidden"), std::string("a\nb")}) {
    EXPECT_NE(TryResult(root_ / "out", name, "x").find("this is not a name of a result"),
              std::string::npos)
        << name;
  }
  EXPECT_EQ(Read(root_ / "victim" / "summary.json"), "{}");
  EXPECT_TRUE(fs::is_empty(root_ / "out"));
}

TEST_F(OutputFolderTest, ALinkIsFollowedAndStays) {
  fs::create_directories(root_ / "disk" / "turn");
  fs::create_directories(root_ / "out");
  fs::create_directory_symlink(root_ / "disk" / "turn", root_ / "out" / "case");
  ASSERT_EQ(TryResult(root_ / "out", "case", "x"), "");
  EXPECT_TRUE(fs::is_symlink(root_ / "out" / "case"));
  EXPECT_EQ(Read(root_ / "disk" / "turn" / "summary.json"), "x");
}

TEST_F(OutputFolderTest, FoldersThatAreStillBeingFilledStay) {
  OutputFolder slow(root_, "case");
  ASSERT_EQ(slow.Create(), "");
  WriteResult("case", "quick");
  ASSERT_EQ(slow.Write("summary.json", "slow"), "");
  ASSERT_EQ(slow.Commit(), "");
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "slow");
}

TEST_F(OutputFolderTest, ManyAtOnceOnOnePlaceAreEachWhole) {
  Put(root_ / "case" / "notes.txt", "mine");
  std::vector<pid_t> all;
  for (int i = 0; i < 6; ++i) {
    all.push_back(fork());
    if (all.back() != 0) continue;
    bool good = true;
    for (int k = 0; k < 10; ++k) {
      good = TryResult(root_, "case", std::to_string(i)).empty() && good;
    }
    _exit(good ? 0 : 1);
  }
  for (const pid_t pid : all) {
    int status = 0;
    waitpid(pid, &status, 0);
    EXPECT_EQ(status, 0);
  }
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), Read(root_ / "case" / "traces.csv"));
  EXPECT_EQ(Read(root_ / "case" / "notes.txt"), "mine");
  EXPECT_EQ(Entries(), 1u);
}

TEST_F(OutputFolderTest, AWriterThatHoldsThePlaceForEverIsNamed) {
  const StateLock held(root_);
  ASSERT_EQ(held.trouble(), "");
  EXPECT_NE(StateLock(root_, 0.05).trouble().find("another run is writing there"),
            std::string::npos);
}

TEST_F(OutputFolderTest, AFileInTheWayIsNamed) {
  Put(root_ / "file", "x");
  const std::string trouble = TryResult(root_ / "file", "case", "x");
  EXPECT_NE(trouble.find("cannot make folder"), std::string::npos) << trouble;
  EXPECT_NE(trouble.find((root_ / "file").string()), std::string::npos) << trouble;
}

// Killed before every change of a file: the result is the old or the new one, never a mixture, the
// user's files are there, and the next run puts everything right.
class KilledPublishing : public OutputFolderTest {
 protected:
  void Prepare() const {
    fs::remove_all(root_);
    WriteResult("case", "old");
    Put(root_ / "case" / "notes.txt", "mine");
    Put(root_ / "case" / "snapshots" / "photo.jpg", "mine");
    Put(root_ / "case" / "rig" / "log.csv", "mine");
    WriteResult("case/fast", "fast");
  }
  void CheckWhole(int call, bool mine) const {
    const std::string summary = Read(root_ / "case" / "summary.json");
    EXPECT_TRUE(summary == "old" || summary == "new") << call << summary;
    for (const char* file : {"traces.csv", "snapshots/a.png"}) {
      EXPECT_EQ(Read(root_ / "case" / file), summary) << call;
    }
    if (!mine) return;
    for (const char* file : {"notes.txt", "snapshots/photo.jpg", "rig/log.csv"}) {
      EXPECT_EQ(Read(root_ / "case" / file), "mine") << call << file;
    }
    EXPECT_EQ(Read(root_ / "case" / "fast" / "summary.json"), "fast") << call;
  }
  // How many calls there were.
  int KillEverywhere(KillAtCalls* killer, bool exchanges) const {
    for (int call = 1;; ++call) {
      Prepare();
      const bool ended = killer->EndsBefore(call);
      EXPECT_TRUE(!ended || killer->exit_code == 0) << killer->exit_code;
      if (exchanges || fs::exists(root_ / "case")) CheckWhole(call, true);
      // The next run: even one of another scenario puts it right.
      WriteResult("other", "x");
      CheckWhole(call, true);
      EXPECT_FALSE(fs::exists(root_ / kStateFolder)) << call;
      WriteResult("case", "new");
      CheckWhole(call, true);
      if (ended || testing::Test::HasFailure()) return call;
    }
  }
};

TEST_F(KilledPublishing, LeavesTheOldOrTheNewResultWithTheUsersFiles) {
  KillAtCalls killer([&] { _exit(TryResult(root_, "case", "new").empty() ? 0 : 1); });
  EXPECT_GT(KillEverywhere(&killer, true), 30);
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "new");
}

TEST_F(KilledPublishing, WithoutExchangeTheNextRunBringsItBack) {
  KillAtCalls killer([&] { _exit(TryResult(root_, "case", "new").empty() ? 0 : 1); });
  killer.missing = {{SYS_renameat2, 1}};
  EXPECT_GT(KillEverywhere(&killer, false), 30);
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "new");
}

TEST_F(KilledPublishing, WithoutSecondNamesTheNextRunBringsItBack) {
  KillAtCalls killer([&] { _exit(TryResult(root_, "case", "new").empty() ? 0 : 1); });
  killer.missing = {{SYS_linkat, 1}};
  for (int call = 1; !testing::Test::HasFailure(); ++call) {
    Prepare();
    const bool ended = killer.EndsBefore(call);
    CheckWhole(call, false);
    WriteResult("other", "x");
    CheckWhole(call, true);
    if (ended) break;
  }
}

TEST_F(KilledPublishing, AnExchangeThatFailsLeavesTheOldResult) {
  Prepare();
  KillAtCalls killer([&] {
    const std::string trouble = TryResult(root_, "case", "new");
    _exit(trouble.find("what was there is as it was") != std::string::npos ? 0 : 1);
  });
  // As on a mount point: neither exchanged nor moved aside.
  killer.missing = {{SYS_renameat2, 1}, {kRenameCall, 2}};
  ASSERT_TRUE(killer.EndsBefore(1'000'000));
  EXPECT_EQ(killer.exit_code, 0);
  CheckWhole(0, true);
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "old");
  // Moved aside, but neither the new one in nor the old one back: the next run brings it back.
  killer.missing = {{SYS_renameat2, 1}, {kRenameCall, 3}};
  ASSERT_TRUE(killer.EndsBefore(1'000'000));
  EXPECT_EQ(killer.exit_code, 0);
  WriteResult("other", "x");
  CheckWhole(0, true);
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "old");
}

}  // namespace
}  // namespace mbv
