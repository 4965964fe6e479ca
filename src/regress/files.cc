#include "regress/files.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>

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

std::string WithoutControls(const std::string& text) {
  std::string clean;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == 0x1b && i + 1 < text.size() && text[i + 1] == '[') {  // a terminal's colour
      i += 2;
      while (i < text.size() && (text[i] < '@' || text[i] > '~')) ++i;
      continue;
    }
    if (c >= 0x20 || c == '\n' || c == '\t') clean += text[i];
  }
  return clean;
}

std::string LastLines(const std::string& text, int count) {
  const std::string clean = WithoutControls(text);
  const size_t end = clean.find_last_not_of("\n ");
  if (end == std::string::npos) return "";
  size_t at = end;
  for (int i = 0; i < count; ++i) {
    const size_t newline = clean.rfind('\n', at);
    if (newline == std::string::npos || newline == 0) return clean.substr(0, end + 1);
    at = newline - 1;
  }
  return clean.substr(at + 2, end - at - 1);
}

std::string UtcNow() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
}

}  // namespace mbv
