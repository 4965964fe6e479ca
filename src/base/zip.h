// ZIP archives: written the same from the same files, read without trusting them.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/diagnostics.h"

struct zip;

namespace mbv {

/// A file in an archive.
struct ArchiveEntry {
  std::string path;  ///< IsPlainPath() (base/files.h), in UTF-8
  std::string content;
  bool executable = false;
};

/// The bytes of an archive: entries in the order of their paths, all of 1980-01-01, readable by
/// all; nothing of the machine that wrote it. Empty, with what went wrong, where libzip fails.
[[nodiscard]] std::optional<std::string> WriteZip(std::vector<ArchiveEntry> entries,
                                                  std::string* trouble);

/// How much an archive may hold.
struct ArchiveLimits {
  std::uint64_t bytes = std::uint64_t{1} << 30;  ///< of all files, unpacked
  std::uint64_t entries = 20'000;
};

/// A file in an archive that is read.
struct ListedEntry {
  std::string path;
  std::uint64_t bytes = 0;  ///< unpacked, as the archive says
  bool executable = false;
  std::uint64_t index = 0;
};

/// An archive that is read without trusting it: from its file, piece by piece.
class ZipFile {
 public:
  /// Lists the files; folders are left out. Findings, all at once, with `file` as their place: what
  /// is not a ZIP, paths that lead outside, links and devices, two files of one path, a file that
  /// is a folder as well, encryption, more than the limits.
  ZipFile(const std::string& file, const ArchiveLimits& limits, Diagnostics* diagnostics);
  ~ZipFile();
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  /// Sorted by path; empty after findings.
  [[nodiscard]] const std::vector<ListedEntry>& entries() const { return entries_; }

  /// Gives the content piece by piece; take() returns false to end it. False then, and after a
  /// finding: content that its checksum contradicts, or that is longer than `entry.bytes`.
  [[nodiscard]] bool Read(const ListedEntry& entry,
                          const std::function<bool(std::string_view)>& take);

 private:
  void Refuse(const std::string& message, const std::string& hint);
  [[nodiscard]] bool Open();
  void List();
  void ListEntry(std::uint64_t index);
  void CheckFolders();

  std::string file_;
  ArchiveLimits limits_;
  Diagnostics* diagnostics_;
  zip* archive_ = nullptr;
  std::vector<ListedEntry> entries_;
};

}  // namespace mbv
