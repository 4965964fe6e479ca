// ROOT/.mbverify: the one folder for what is not yet, or no longer, a result below ROOT.
#pragma once

#include <filesystem>
#include <string>

namespace mbv {

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

}  // namespace mbv
