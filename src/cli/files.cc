#include "cli/files.h"

#include <fmt/format.h>

#include <filesystem>

#include "core/files.h"
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

std::vector<std::string> ExpandYaml(const std::string& argument, std::vector<std::string>* unread) {
  std::error_code error;
  if (!fs::is_directory(argument, error)) return {argument};
  return FilesBelow(argument, ".yaml", unread);
}

std::vector<std::string> ExpandScenarios(const std::vector<std::string>& arguments,
                                         std::string* trouble) {
  std::vector<std::string> scenarios, unread;
  for (const std::string& argument : arguments) {
    std::error_code error;
    if (!fs::is_directory(argument, error)) {
      scenarios.push_back(argument);
      continue;
    }
    const size_t before = scenarios.size();
    for (const std::string& file : ExpandYaml(argument, &unread)) {
      if (InMustFail(file, argument) || !ReadScenarioHead(file).is_scenario) continue;
      scenarios.push_back(file);
    }
    if (scenarios.size() == before)
      unread.push_back(argument + ": error: no scenario in this folder");
  }
  for (const std::string& line : unread) *trouble += (trouble->empty() ? "" : "\n") + line;
  return scenarios;
}

std::optional<std::pair<std::string, std::string>> SplitSet(const std::string& text) {
  const size_t at = text.find('=');
  if (at == std::string::npos || at == 0) return {};
  return std::pair{text.substr(0, at), text.substr(at + 1)};
}

int WriteWholeFile(const std::string& path, const std::string& content,
                   const std::vector<InputFile>& inputs) {
  std::string trouble;
  if (const std::string input = SameFile(path, inputs); !input.empty()) {
    trouble = fmt::format("{} is {}, which was read for it: choose another file", path,
                          input == path ? "a file" : input);
  } else {
    trouble = WriteFile(path, content);
  }
  if (trouble.empty()) return 0;
  fmt::print(stderr, "error: {}\n", trouble);
  return 2;
}

}  // namespace mbv
