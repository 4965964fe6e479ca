// Folders for files that nobody keeps.
#include "core/scratch_folder.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>

#include "core/files.h"

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
    EXPECT_TRUE(fs::is_empty(path));
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

}  // namespace
}  // namespace mbv
