// ZIP archives: written the same from the same files, read without trusting them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"

namespace mbv {

/// A file in an archive.
struct ArchiveEntry {
  std::string path;  ///< IsPlainPath() (core/names.h), in UTF-8
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

/// The files of an archive, sorted by path; folders are left out. Nothing is unpacked to disk.
/// Findings, all at once, with `file` as their place: what is no ZIP, paths that lead outside,
/// links and devices, two files of one path, a file that is a folder as well, encryption, more than
/// the limits (whatever the archive says of its sizes), content that its checksum contradicts.
[[nodiscard]] std::optional<std::vector<ArchiveEntry>> ReadZip(const std::string& bytes,
                                                               const std::string& file,
                                                               const ArchiveLimits& limits,
                                                               Diagnostics* diagnostics);

}  // namespace mbv
