#include "core/word_hints.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace mbv {

std::string DidYouMean(const std::string& word, const std::vector<std::string>& candidates,
                       const std::string& otherwise) {
  std::string hint = DidYouMean(word, candidates);
  return hint.empty() ? otherwise : hint;
}

std::string DidYouMeanPath(const std::string& path, const std::string& otherwise) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path found;
  for (const fs::path& part : fs::path(path)) {
    if (fs::exists(found / part, error)) {
      found /= part;
      continue;
    }
    std::vector<std::string> names;
    const fs::path folder = found.empty() ? fs::path(".") : found;
    for (auto entry = fs::directory_iterator(folder, error);
         !error && entry != fs::directory_iterator(); entry.increment(error)) {
      names.push_back(entry->path().filename().string());
    }
    std::sort(names.begin(), names.end());  // the file system's order is nobody's
    const std::string near = ClosestWord(part.string(), names);
    if (near.empty()) return otherwise;
    found /= near;
  }
  return found == fs::path(path) ? otherwise : fmt::format("did you mean '{}'?", found.string());
}

}  // namespace mbv
