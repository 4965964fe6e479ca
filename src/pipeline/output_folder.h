// A result folder that appears whole or not at all.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace mbv {

/// Gives a file's content piece by piece.
using FileContent = std::function<void(const std::function<void(std::string_view)>& write)>;

/// Files are written into a hidden temporary folder beside the target; Commit() exchanges it with
/// the target in one step. Without Commit() the old result stays as it was and the temporary
/// folder is removed. Temporary folders left by killed runs are removed by the next one (they are
/// told by a lock that ends with its process).
class OutputFolder {
 public:
  /// \param marker  file that tells a result of the same kind, which may be replaced
  explicit OutputFolder(std::filesystem::path target, std::string marker = "summary.json");
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Each returns "" or what went wrong, with the path and the system's reason.
  [[nodiscard]] std::string Create();
  [[nodiscard]] std::string Write(const std::string& name, const std::string& content);
  [[nodiscard]] std::string Write(const std::string& name, const FileContent& content);
  [[nodiscard]] std::string Commit();

  [[nodiscard]] const std::filesystem::path& target() const { return target_; }

 private:
  void RemoveLeftovers() const;

  std::filesystem::path target_, temporary_;
  std::string marker_;
  int lock_ = -1;  ///< file descriptor of the temporary folder, locked while it is being filled
};

}  // namespace mbv
