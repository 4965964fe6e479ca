#include "cli/files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "scenario/load_scenario.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

bool InMustFail(const fs::path& file, const fs::path& below) {
  for (const fs::path& part : file.lexically_relative(below).parent_path()) {
    if (part == "must_fail") return true;
  }
  return false;
}

}  // namespace

std::vector<std::string> ExpandYaml(const std::string& argument) {
  std::error_code error;
  if (!fs::is_directory(argument, error)) return {argument};
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(argument, error)) {
    if (entry.is_regular_file(error) && entry.path().extension() == ".yaml") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<std::string> ExpandScenarios(const std::vector<std::string>& arguments,
                                         std::string* trouble) {
  std::vector<std::string> scenarios;
  for (const std::string& argument : arguments) {
    std::error_code error;
    if (!fs::is_directory(argument, error)) {
      scenarios.push_back(argument);
      continue;
    }
    const size_t before = scenarios.size();
    for (const std::string& file : ExpandYaml(argument)) {
      if (InMustFail(file, argument) || !ReadScenarioHead(file).is_scenario) continue;
      scenarios.push_back(file);
    }
    if (scenarios.size() == before) *trouble = argument + ": error: no scenario in this folder";
  }
  return scenarios;
}

std::optional<std::pair<std::string, std::string>> SplitSet(const std::string& text) {
  const size_t at = text.find('=');
  if (at == std::string::npos || at == 0) return {};
  return std::pair{text.substr(0, at), text.substr(at + 1)};
}

int WriteWholeFile(const std::string& path, const std::string& content) {
  const std::string temporary = path + ".tmp-" + std::to_string(getpid());
  errno = 0;
  std::ofstream stream(temporary, std::ios::binary);
  stream.write(content.data(), static_cast<std::streamsize>(content.size()));
  stream.close();
  std::error_code error;
  if (stream) fs::rename(temporary, path, error);
  if (stream && !error) return 0;
  const std::string reason = error ? error.message() : std::strerror(errno);
  fs::remove(temporary, error);
  fmt::print(stderr, "error: cannot write {}: {}\n", path, reason);
  return 2;
}

}  // namespace mbv
