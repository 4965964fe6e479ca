// A result folder that appears whole or not at all, beside whatever else its user keeps in it.
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mbv {

// ROOT/.mbverify: the one folder for what is not yet, or no longer, a result below ROOT.

inline constexpr const char* kStateFolder = ".mbverify";

/// Descriptor of a folder with a lock that ends with this process, or -1 with errno
/// (EWOULDBLOCK: held by another process). File systems without locks give the descriptor alone.
[[nodiscard]] int LockFolder(const std::filesystem::path& folder);

/// Makes ROOT/.mbverify and holds its lock: whoever publishes below ROOT does so one after the
/// other. The folder goes when it is empty.
class StateLock {
 public:
  /// Waits up to `wait_s` for others.
  explicit StateLock(const std::filesystem::path& root, double wait_s = 60.0);
  ~StateLock();
  StateLock(const StateLock&) = delete;
  StateLock& operator=(const StateLock&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// Why there is no lock; "" if there is.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

 private:
  bool TryOnce();  // false: try again

  std::filesystem::path folder_;
  std::string trouble_;
  int descriptor_ = -1;
};

/// Gives a file's content piece by piece.
using FileContent = std::function<void(const std::function<void(std::string_view)>& write)>;

/// The list of the files in a result folder that mbverify wrote; only these are ever replaced.
inline constexpr const char* kFileList = ".mbverify-files";

/// Relative paths of the files that a folder's list names; empty without one.
[[nodiscard]] std::set<std::string> ReadFileList(const std::filesystem::path& folder);

/// Files are written into ROOT/.mbverify/stage-…; Commit() makes them durable and exchanges the
/// folder with ROOT/NAME in one step. What the old folder holds beyond its list (notes, pictures,
/// results of other scenarios) is in the new one, too; a file of that kind whose name is needed is
/// refused. Without Commit() the old result stays as it was. What killed runs left is put right by
/// the next one (recognised by a lock that ends with its process).
class OutputFolder {
 public:
  /// `name`: "four_bar/turn".
  OutputFolder(std::filesystem::path root, std::string name);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  /// Each returns "" or what went wrong, with the path and the system's reason.
  [[nodiscard]] std::string Create();
  [[nodiscard]] std::string Write(const std::string& name, const std::string& content);
  [[nodiscard]] std::string Write(const std::string& name, const FileContent& content);
  /// Takes a folder that is already filled, on the same file system; all in it counts as ours.
  [[nodiscard]] std::string Adopt(const std::filesystem::path& folder);
  [[nodiscard]] std::string Commit();

  /// All at once: creates the folder, writes files (name, content) and commits.
  [[nodiscard]] std::string WriteAll(const std::vector<std::pair<std::string, std::string>>& files);

  [[nodiscard]] const std::filesystem::path& target() const { return target_; }

 private:
  [[nodiscard]] std::string Locate();
  [[nodiscard]] std::string WriteList();

  std::filesystem::path root_, target_;
  std::filesystem::path place_;  ///< target, links followed
  std::filesystem::path stage_;  ///< empty until created
  std::set<std::string> files_;  ///< written so far, relative
  std::string name_;
  bool committed_ = false;
  int lock_ = -1;  ///< file descriptor of the stage, locked while it is being filled
};

}  // namespace mbv
