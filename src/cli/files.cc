#include "cli/files.h"

#include <fmt/format.h>

#include <filesystem>

#include "cli/cli.h"
#include "cli/terminal.h"
#include "core/files.h"
#include "pipeline/check_file.h"
#include "scenario/find_model.h"
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

std::string WhyRefused(const std::string& path, const std::vector<InputFile>& inputs) {
  const std::string input = SameFile(path, inputs);
  if (input.empty()) return "";
  return fmt::format("{} is {}, which was read for it: choose another file", path,
                     input == path ? "a file" : input);
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
  for (const std::string& given : arguments) {
    const std::string argument = FindScenario(given);
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

bool ReadAssignments(const std::vector<std::string>& texts, const char* option, const char* example,
                     std::vector<SetValue>* values, const std::string& section) {
  for (const std::string& text : texts) {
    const auto value = SplitSet(text);
    if (!value) {
      Say(stderr, "{} {}: error: write key=value, e.g. {}\n", option, text, example);
      return false;
    }
    values->emplace_back(section + value->first, value->second);
  }
  return true;
}

std::vector<std::string> FilesToRun(const std::vector<std::string>& arguments,
                                    const std::vector<std::string>& written, int* exit_code) {
  std::string trouble;
  std::vector<std::string> files = ExpandScenarios(arguments, &trouble);
  *exit_code = trouble.empty() ? 0 : Refuse(trouble, "");
  for (const std::string& file : files) {
    for (const std::string& path : written) {
      if (*exit_code == 0) *exit_code = RefuseInput(path, file);
    }
  }
  if (*exit_code != 0) files.clear();
  return files;
}

std::vector<InputFile> InputsOf(const std::string& scenario) {
  const InputWatch watch;
  (void)CheckFile(scenario);
  std::vector<InputFile> inputs = watch.files();
  inputs.push_back({scenario, ""});  // read or not
  return inputs;
}

int RefuseInput(const std::string& path, const std::string& scenario) {
  std::error_code error;
  if (path.empty() || !fs::exists(path, error)) return 0;  // nothing that could be lost
  const std::string trouble = WhyRefused(path, InputsOf(scenario));
  if (trouble.empty()) return 0;
  Say(stderr, "error: {}\n", trouble);
  return 2;
}

int WriteWholeFile(const std::string& path, const std::string& content,
                   const std::vector<InputFile>& inputs) {
  std::string trouble = WhyRefused(path, inputs);
  if (trouble.empty()) trouble = WriteFile(path, content);
  if (trouble.empty()) return 0;
  Say(stderr, "error: {}\n", trouble);
  return 2;
}

}  // namespace mbv
