// Result folders copied without what is hidden or a link.
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

}  // namespace mbv
