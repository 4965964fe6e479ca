// Folders for temporary files.
#include "base/scratch_folder.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <string>

#include "base/files.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

// TMPDIR for the time of a test.
class TemporaryPlace {
 public:
  explicit TemporaryPlace(const std::string& place) {
    if (const char* old = std::getenv("TMPDIR")) old_ = old;
    setenv("TMPDIR", place.c_str(), 1);
  }
  ~TemporaryPlace() {
    if (old_) {
      setenv("TMPDIR", old_->c_str(), 1);
    } else {
      unsetenv("TMPDIR");
    }
  }
  TemporaryPlace(const TemporaryPlace&) = delete;
  TemporaryPlace& operator=(const TemporaryPlace&) = delete;

 private:
  std::optional<std::string> old_;
};

TEST(ScratchFolder, IsPrivateAndGoesWithItsContent) {
  fs::path path;
  {
    const ScratchFolder folder("test");
    ASSERT_EQ(folder.trouble(), "");
    path = folder.path();
    EXPECT_EQ(fs::status(path).permissions(), fs::perms::owner_all);
    EXPECT_EQ(std::distance(fs::directory_iterator(path), {}), 1) << "its lock";
    fs::create_directories(path / "deep" / "er");
    std::ofstream(path / "deep" / "er" / "file") << "x";
  }
  EXPECT_FALSE(fs::exists(path));
}

// A name that another user can foresee is a link that they laid there before.
TEST(ScratchFolder, NamesDiffer) {
  const ScratchFolder one("test"), two("test");
  EXPECT_NE(one.path(), two.path());
  EXPECT_TRUE(one.path().filename().string().starts_with("mbverify-test-"));
}

TEST(PrivateFolder, SaysByErrnoWhyThereIsNone) {
  const ScratchFolder outer("test");
  EXPECT_TRUE(MakePrivateFolder(outer.path() / "missing" / "stage-").empty());
  EXPECT_EQ(errno, ENOENT);
  const fs::path made = MakePrivateFolder(outer.path() / "stage-");
  EXPECT_TRUE(made.filename().string().starts_with("stage-"));
  EXPECT_EQ(fs::status(made).permissions(), fs::perms::owner_all);
}

TEST(ScratchFolder, LiesWhereTheSystemWantsTemporaryFiles) {
  const ScratchFolder outer("outer");
  const TemporaryPlace place(outer.path().string());
  const ScratchFolder inner("inner");
  EXPECT_EQ(inner.path().parent_path(), outer.path());
}

TEST(ScratchFolder, SaysWhereNoneCanBeMade) {
  const ScratchFolder outer("outer");
  const TemporaryPlace place((outer.path() / "missing").string());
  const ScratchFolder inner("inner");
  EXPECT_TRUE(inner.path().empty());
  EXPECT_NE(inner.trouble().find("missing"), std::string::npos) << inner.trouble();
}

// Runs `work` in a process that then waits; its folder's path, and the process.
struct Other {
  pid_t pid = -1;
  fs::path folder;
};
Other InOtherProcess(const std::function<void(const fs::path&)>& work) {
  int ends[2];
  EXPECT_EQ(pipe(ends), 0);
  Other other;
  other.pid = fork();
  if (other.pid == 0) {
    const ScratchFolder folder("other");
    work(folder.path());
    const std::string path = folder.path().string() + "\n";
    if (write(ends[1], path.data(), path.size()) < 0) _exit(1);
    for (;;) pause();
  }
  std::string path;
  for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';) path += c;
  close(ends[0]);
  close(ends[1]);
  other.folder = path;
  return other;
}

int EndOf(const Other& other, int signal) {
  int status = 0;
  kill(other.pid, signal);
  waitpid(other.pid, &status, 0);
  return WIFSIGNALED(status) ? WTERMSIG(status) : -1;
}

// More names than a look at a folder gives at once, some below, one a link out of it.
void Fill(const fs::path& folder) {
  for (int i = 0; i < 300; ++i) {
    std::ofstream(folder / ("a file of results, number " + std::to_string(i))) << "x";
  }
  fs::create_directories(folder / "results" / "four_bar" / "turn");
  std::ofstream(folder / "results" / "four_bar" / "turn" / "summary.json") << "{}";
  fs::create_symlink(folder.parent_path() / "kept", folder / "link");
}

TEST(ScratchFolder, GoesAtOnceWithAnInterruptedProcess) {
  const ScratchFolder outer("outer");
  const TemporaryPlace place(outer.path().string());
  std::ofstream(outer.path() / "kept") << "x";
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const Other other = InOtherProcess(Fill);
    EXPECT_TRUE(fs::exists(other.folder / "results"));
    EXPECT_EQ(EndOf(other, signal), signal) << "the caller sees what ended it";
    EXPECT_FALSE(fs::exists(other.folder)) << signal;
  }
  EXPECT_TRUE(fs::exists(outer.path() / "kept"));
}

TEST(ScratchFolder, OfAKilledProcessGoesWithTheNextOne) {
  const ScratchFolder outer("outer");
  const TemporaryPlace place(outer.path().string());
  const Other killed = InOtherProcess(Fill), living = InOtherProcess(Fill);
  EXPECT_EQ(EndOf(killed, SIGKILL), SIGKILL);
  EXPECT_TRUE(fs::exists(killed.folder));
  // Of a like name, but no scratch folder.
  const fs::path own = outer.path() / "mbverify-data-backup";
  fs::create_directory(own);
  std::ofstream(own / "thesis.csv") << "x";
  // Where a link stands nothing is followed.
  const fs::path linked = outer.path() / "linked";
  fs::rename(killed.folder, linked);
  fs::create_symlink(linked, outer.path() / "mbverify-link-abcdef");
  { const ScratchFolder next("next"); }
  EXPECT_TRUE(fs::exists(linked / "results"));
  fs::rename(linked, killed.folder);
  { const ScratchFolder next("next"); }
  EXPECT_FALSE(fs::exists(killed.folder));
  EXPECT_TRUE(fs::exists(living.folder / "results"));
  EXPECT_TRUE(fs::exists(own / "thesis.csv"));
  EXPECT_EQ(EndOf(living, SIGTERM), SIGTERM);
}

TEST(ScratchFolder, IsNotRemovedByAForkedChild) {
  const ScratchFolder folder("test");
  for (const bool signalled : {false, true}) {
    const pid_t pid = fork();
    if (pid == 0) {
      if (signalled) raise(SIGTERM);
      folder.~ScratchFolder();
      _exit(0);
    }
    int status = 0;
    waitpid(pid, &status, 0);
    EXPECT_TRUE(fs::exists(folder.path())) << signalled;
  }
}

// nohup stays nohup.
TEST(ScratchFolder, LeavesIgnoredSignalsIgnored) {
  const pid_t pid = fork();
  if (pid == 0) {
    signal(SIGHUP, SIG_IGN);
    const ScratchFolder folder("test");
    raise(SIGHUP);
    _exit(fs::exists(folder.path()) ? 7 : 8);
  }
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 7);
}

}  // namespace
}  // namespace mbv
