#include "pipeline/home_folder.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace mbv {

namespace fs = std::filesystem;

int LineNaming(const std::string& text, const std::string& path) {
  const auto part_of_name = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || (c & 0x80) != 0;
  };
  for (size_t at = text.find(path); at != std::string::npos; at = text.find(path, at + 1)) {
    const size_t end = at + path.size();
    if (at > 0 && part_of_name(text[at - 1])) continue;
    if (end < text.size() && part_of_name(text[end])) continue;
    return 1 +
           static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(at), '\n'));
  }
  return 0;
}

std::string HomeFolder() {
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home != '/') return "";
  fs::path folder = fs::path(home).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  return folder == folder.root_path() ? "" : folder.string();
}

}  // namespace mbv
