// Results appear whole or not at all.
#include "pipeline/output_folder.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

namespace mbv {
namespace {

namespace fs = std::filesystem;

class OutputFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    root_ =
        fs::temp_directory_path() /
        (std::string("mbv_out_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  static std::string Read(const fs::path& path) {
    std::ifstream stream(path);
    std::stringstream text;
    text << stream.rdbuf();
    return text.str();
  }
  static void WriteResult(const fs::path& target, const std::string& content) {
    OutputFolder folder(target);
    ASSERT_EQ(folder.Create(), "");
    ASSERT_EQ(folder.Write("summary.json", content), "");
    ASSERT_EQ(folder.Commit(), "");
  }
  // Names in the parent of the target, hidden ones included.
  [[nodiscard]] size_t Entries() const {
    return static_cast<size_t>(std::distance(fs::directory_iterator(root_), {}));
  }

  fs::path root_;
};

TEST_F(OutputFolderTest, AppearsOnCommit) {
  OutputFolder folder(root_ / "case");
  ASSERT_EQ(folder.Create(), "");
  ASSERT_EQ(folder.Write("snapshots/a.png", "x"), "");
  EXPECT_FALSE(fs::exists(root_ / "case"));
  ASSERT_EQ(folder.Write("summary.json", "{}"), "");
  ASSERT_EQ(folder.Commit(), "");
  EXPECT_EQ(Read(root_ / "case" / "snapshots" / "a.png"), "x");
}

TEST_F(OutputFolderTest, ReplacesTheOldResultAsAWhole) {
  WriteResult(root_ / "case", "old");
  std::ofstream(root_ / "case" / "left_over.png") << "x";
  WriteResult(root_ / "case", "new");
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "new");
  EXPECT_FALSE(fs::exists(root_ / "case" / "left_over.png"));
  EXPECT_EQ(Entries(), 1u);
}

TEST_F(OutputFolderTest, WithoutCommitTheOldResultStays) {
  WriteResult(root_ / "case", "old");
  {
    OutputFolder interrupted(root_ / "case");
    ASSERT_EQ(interrupted.Create(), "");
    ASSERT_EQ(interrupted.Write("summary.json", "half"), "");
  }
  EXPECT_EQ(Read(root_ / "case" / "summary.json"), "old");
  EXPECT_EQ(Entries(), 1u);
}

TEST_F(OutputFolderTest, LeftoversOfDeadProcessesAreRemoved) {
  fs::create_directories(root_ / ".case.tmp-12345" / "snapshots");
  fs::create_directories(root_ / ".other.tmp-12345");
  WriteResult(root_ / "case", "{}");
  EXPECT_FALSE(fs::exists(root_ / ".case.tmp-12345"));
  EXPECT_TRUE(fs::exists(root_ / ".other.tmp-12345"));
}

TEST_F(OutputFolderTest, FoldersThatAreStillBeingFilledStay) {
  fs::create_directories(root_ / ".case.tmp-12345");
  const int other = open((root_ / ".case.tmp-12345").c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(flock(other, LOCK_EX), 0);  // as another process holds it
  WriteResult(root_ / "case", "{}");
  EXPECT_TRUE(fs::exists(root_ / ".case.tmp-12345"));
  close(other);
  WriteResult(root_ / "case", "{}");
  EXPECT_FALSE(fs::exists(root_ / ".case.tmp-12345"));
}

TEST_F(OutputFolderTest, ForeignFilesAreNotReplaced) {
  fs::create_directories(root_ / "case");
  std::ofstream(root_ / "case" / "thesis.tex") << "x";
  EXPECT_EQ(OutputFolder(root_ / "case").Create(),
            "cannot replace " + (root_ / "case").string() +
                ": it holds something that is no mbverify result");
  EXPECT_TRUE(fs::exists(root_ / "case" / "thesis.tex"));
}

TEST_F(OutputFolderTest, AFileInTheWayIsNamed) {
  fs::create_directories(root_);
  std::ofstream(root_ / "file") << "x";
  const std::string trouble = OutputFolder(root_ / "file" / "case").Create();
  EXPECT_NE(trouble.find("cannot make folder"), std::string::npos) << trouble;
  EXPECT_NE(trouble.find((root_ / "file").string()), std::string::npos) << trouble;
}

}  // namespace
}  // namespace mbv
