// A folder for files that nobody keeps.
#pragma once

#include <filesystem>
#include <string>

namespace mbv {

/// A new, empty folder that only this user may enter, with a name that cannot be guessed, in the
/// system's folder of temporary files (TMPDIR). It goes with this object, with all that is in it.
class ScratchFolder {
 public:
  /// `purpose`: a word in its name, for people who find one that a killed program left.
  explicit ScratchFolder(const std::string& purpose);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  /// "" or why there is none; then path() is empty.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  std::string trouble_;
};

}  // namespace mbv
