#include "regress/plain_files.h"

#include <fmt/format.h>

#include "core/files.h"

namespace mbv {

namespace fs = std::filesystem;

namespace {

std::string Copy(const fs::path& from, const fs::path& to, const std::set<std::string>& wanted,
                 const std::string& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(from / folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    const std::string path = folder.empty() ? name : folder + "/" + name;
    const fs::file_type type = entry->symlink_status(error).type();
    std::string trouble;
    if (type == fs::file_type::directory && !name.starts_with('.')) {
      trouble = Copy(from, to, wanted, path);
    } else if (type == fs::file_type::regular &&
               (wanted.empty() ? !name.starts_with('.') : wanted.contains(path))) {
      const auto content = ReadWholeFile(entry->path());
      trouble = content ? WriteFile(to / path, *content, false)
                        : fmt::format("cannot read {}", entry->path().string());
    }
    if (!trouble.empty()) return trouble;
  }
  return error ? fmt::format("cannot read {}: {}", (from / folder).string(), error.message()) : "";
}

}  // namespace

std::string CopyPlainFiles(const fs::path& from, const fs::path& to,
                           const std::set<std::string>& wanted) {
  std::error_code error;
  fs::create_directories(to, error);
  if (error) return fmt::format("cannot make folder {}: {}", to.string(), error.message());
  return Copy(from, to, wanted, "");
}

}  // namespace mbv
