// A file that grows while its rows are computed, and that a later process goes on with.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace mbv {

/// Unlike WriteFile(), what a kill leaves is the part that was written: whoever goes on says how
/// much of it is good. Functions return "" or what went wrong, with the path and the reason.
class GrowingFile {
 public:
  explicit GrowingFile(std::filesystem::path path) : path_(std::move(path)) {}
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  /// Opens the file, or makes it, and cuts it to its first `keep` bytes.
  [[nodiscard]] std::string Open(std::uint64_t keep);
  [[nodiscard]] std::string Append(std::string_view bytes);
  /// Makes what was written durable.
  [[nodiscard]] std::string Finish();

 private:
  [[nodiscard]] std::string Trouble(const char* what) const;

  std::filesystem::path path_;
  int file_ = -1;
};

}  // namespace mbv
