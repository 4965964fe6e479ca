// Text of logs, times, and files found below a folder.
#pragma once

#include <filesystem>
#include <set>
#include <string>

namespace mbv {

/// Copies the regular files of a folder: `wanted` (relative names), or all that are not hidden if
/// it is empty. Links are not followed. "" or what went wrong.
[[nodiscard]] std::string CopyPlainFiles(const std::filesystem::path& from,
                                         const std::filesystem::path& to,
                                         const std::set<std::string>& wanted);

/// The last `count` lines of a text, without control characters (escape sequences go, too).
[[nodiscard]] std::string LastLines(const std::string& text, int count);
[[nodiscard]] std::string WithoutControls(const std::string& text);

/// "2026-01-31T02:00:00Z" now.
[[nodiscard]] std::string UtcNow();

}  // namespace mbv
