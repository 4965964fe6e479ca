// A folder with files of one test, removed after it.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace mbv::test {

class TestFolder {
 public:
  /// No other process has it: tests of one fixture run at the same time. `name`: unlike those of
  /// other folders of the same test.
  explicit TestFolder(const std::string& name)
      : path_(std::filesystem::path(testing::TempDir()) /
              ("mbv_" + name + "_" + std::to_string(getpid()))) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~TestFolder() { std::filesystem::remove_all(path_); }
  TestFolder(const TestFolder&) = delete;
  TestFolder& operator=(const TestFolder&) = delete;

  [[nodiscard]] std::string PathOf(const std::string& name) const {
    return (path_ / name).string();
  }
  /// Writes a file, and the folders on the way to it; its path.
  std::string Write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << text;
    return PathOf(name);
  }

 private:
  std::filesystem::path path_;
};

}  // namespace mbv::test
