// A folder with files of one test, removed after it.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace mbv::test {

class TestFolder {
 public:
  /// `name`: unlike those of all tests that run at the same time.
  explicit TestFolder(const std::string& name)
      : path_(std::filesystem::path(testing::TempDir()) / ("mbv_" + name)) {
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
