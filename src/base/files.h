// Files: read whole, written whole or not at all, distinguished by fingerprints.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mbv {

/// The content of a regular file; empty if it is none or cannot be read.
[[nodiscard]] std::optional<std::string> ReadWholeFile(const std::filesystem::path& path);

/// Writes a file; folders are made. Where nothing or a regular file is, the content is made durable
/// in a temporary file beside it, which then takes its name: a kill at any moment leaves the old
/// file or the new one. Anything else (a device, a FIFO, a link) is opened and written. `sweep`:
/// SweepTemporaries() of its folder first. "" or what went wrong.
[[nodiscard]] std::string WriteFile(const std::filesystem::path& path, const std::string& content,
                                    bool sweep = true);

/// Removes temporary files of killed writers from a folder.
void SweepTemporaries(const std::filesystem::path& folder);

/// Writes all bytes; false with errno.
[[nodiscard]] bool WriteBytes(int descriptor, std::string_view bytes);
/// Makes what was written durable where that is possible; false with errno.
[[nodiscard]] bool Sync(int descriptor);
/// Both.
[[nodiscard]] bool WriteAll(int descriptor, std::string_view content);

/// Makes the entries of a folder durable; best effort, some file systems cannot.
void SyncFolder(const std::filesystem::path& folder);

/// 64-bit FNV-1a, for distinguishing versions of files (no protection against forgery).
class Fingerprint {
 public:
  void Add(const std::string& bytes);  ///< the length counts, so "ab"+"c" is not "a"+"bc"
  void AddFile(const std::filesystem::path& path);  ///< name and content
  [[nodiscard]] std::string Text() const;           ///< 16 hexadecimal digits

 private:
  void Mix(const char* bytes, size_t count);
  std::uint64_t hash_ = 14695981039346656037ULL;
};

/// Regular files below a folder whose names have this ending, sorted; links to folders are not
/// followed. Folders that cannot be read are reported, one line each.
[[nodiscard]] std::vector<std::string> FilesBelow(const std::filesystem::path& folder,
                                                  const std::string& ending,
                                                  std::vector<std::string>* unread);

/// Makes a new folder that only this user may enter: `prefix` and random letters, which no one can
/// lay a link for in advance. Empty, with errno, where none can be made.
[[nodiscard]] std::filesystem::path MakePrivateFolder(const std::filesystem::path& prefix);

/// The running program's file: by /proc, without it by the name that it was called with and PATH.
/// Empty if neither leads to it.
[[nodiscard]] std::filesystem::path ProgramFile();
/// What starts it again, even where its file has been replaced since.
[[nodiscard]] std::string ProgramToStart();
/// ProgramFile() without /proc, of this name.
[[nodiscard]] std::filesystem::path ProgramCalled(const std::string& name);

/// Six random letters and digits for names that must not be guessed.
[[nodiscard]] std::string RandomLetters();

// A file that grows while its rows are computed, and that a later process goes on with.

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

// Names that become files and folders: of models, scenarios and results.

inline constexpr size_t kLongestName = 64;
inline constexpr const char* kNameRule =
    "a letter, then letters, digits and '_', at most 64 characters";

/// Whether a name follows kNameRule (ASCII letters and digits).
[[nodiscard]] bool IsName(std::string_view name);

/// "My arm-2" → "My_arm_2"; "" when nothing is left.
[[nodiscard]] std::string NearestName(const std::string& name);

/// A path that stays below the folder it is appended to, whatever it says: parts between single
/// '/', none empty, none beginning with '.' (so no "..", nothing hidden), without control
/// characters and '\', at most 200 bytes each.
[[nodiscard]] bool IsPlainPath(std::string_view path);

/// The nearest such path: what is not allowed becomes '_'. "" stays "".
[[nodiscard]] std::string NearestPlainPath(std::string_view path);

}  // namespace mbv
