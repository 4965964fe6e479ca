// A folder for temporary files.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>

namespace mbv {

/// A new folder that only this user may enter, with a name that cannot be guessed, in the system's
/// folder of temporary files (TMPDIR); at first it holds nothing but its lock. It goes with this
/// object, with all that is in it; at once when the process is interrupted or terminated; and where
/// the process was killed, when the next scratch folder is made there.
class ScratchFolder {
 public:
  /// `purpose`: a word in its name.
  explicit ScratchFolder(const std::string& purpose);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  /// "" or why there is none; then path() is empty.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  [[nodiscard]] bool Lock();

  std::filesystem::path path_;
  std::string trouble_;
  int lock_ = -1;     ///< descriptor of the lock, which ends with the process
  pid_t owner_ = -1;  ///< a process forked later leaves the folder alone
};

}  // namespace mbv
