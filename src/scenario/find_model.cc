#include "scenario/find_model.h"

#include <dlfcn.h>

#include <cstdlib>
#include <set>

#include "base/diagnostics.h"
#include "base/files.h"
#include "base/text.h"
#include "model_file/load_model.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

bool IsFile(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool IsFolder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

// A folder with models above a file: <prefix>/share/mbverify of what is installed below <prefix>,
// or a source tree.
std::optional<fs::path> ShippedAbove(const fs::path& file) {
  for (fs::path folder = file.parent_path();; folder = folder.parent_path()) {
    const fs::path share = folder / "share" / "mbverify";
    if (IsFolder(share / "models")) return share;
    if (IsFolder(folder / "models") && IsFolder(folder / "scenarios")) return folder;
    if (folder == folder.parent_path()) return std::nullopt;
  }
}

// The folder with the models and scenarios that the running program came with, or the library that
// this is a part of; else those of an installation.
std::optional<fs::path> ShippedFolder() {
  if (const fs::path program = ProgramFile(); !program.empty()) {
    if (std::optional<fs::path> folder = ShippedAbove(program)) return folder;
  }
  std::error_code error;
  Dl_info here;
  if (dladdr(reinterpret_cast<const void*>(&ShippedFolder), &here) != 0 &&
      here.dli_fname != nullptr) {
    const fs::path object = fs::canonical(here.dli_fname, error);
    if (!error) {
      if (std::optional<fs::path> folder = ShippedAbove(object)) return folder;
    }
  }
  for (const char* installed : {internal::kInstalledData, "/usr/share/mbverify"}) {
    if (IsFolder(fs::path(installed) / "models")) return installed;
  }
  return std::nullopt;
}

bool IsModelPath(const std::string& name) {
  return name.find('/') != std::string::npos || name.ends_with(".yaml") || IsRobotFile(name);
}

fs::path Absolute(const fs::path& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  return (error ? path : absolute).lexically_normal();
}

}  // namespace

std::vector<fs::path> ModelFolders(const fs::path& start) {
  std::vector<fs::path> candidates;
  for (fs::path folder = Absolute(start / "x").parent_path();; folder = folder.parent_path()) {
    candidates.push_back(folder / "models");
    if (folder == folder.parent_path()) break;
  }
  if (const char* variable = std::getenv("MBVERIFY_MODELS")) candidates.emplace_back(variable);
  candidates.push_back(Absolute("models"));
  if (const auto shipped = ShippedModels()) candidates.push_back(*shipped);
  std::vector<fs::path> folders;
  for (const fs::path& candidate : candidates) {
    if (IsFolder(candidate)) folders.push_back(candidate);
  }
  return folders;
}

std::optional<std::string> FindModel(const std::string& name, const fs::path& start) {
  if (IsModelPath(name)) {
    const fs::path path = fs::path(name).is_absolute() ? fs::path(name) : start / name;
    std::error_code error;
    // A pipe will do.
    if (fs::exists(path, error) && !IsFolder(path)) return Shown(CompletedModel(path.string()));
    return std::nullopt;
  }
  for (const fs::path& folder : ModelFolders(start)) {
    const fs::path path = folder / name / "model.yaml";
    if (IsFile(path)) return Shown(path);
  }
  return std::nullopt;
}

std::vector<std::string> ModelNames(const fs::path& start) {
  std::set<std::string> names;
  for (const fs::path& folder : ModelFolders(start)) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      if (IsFile(entry.path() / "model.yaml")) names.insert(entry.path().filename());
    }
  }
  return {names.begin(), names.end()};
}

std::string ModelHint(const std::string& name, const fs::path& start) {
  if (IsModelPath(name)) {
    const fs::path path = fs::path(name).is_absolute() ? fs::path(name) : start / name;
    return DidYouMeanPath(path.lexically_normal().string());
  }
  constexpr size_t kMost = 8;
  const std::vector<std::string> names = ModelNames(start);
  return DidYouMean(name, names, names.empty() ? "" : "known models: " + Joined(names, kMost));
}

std::string FindScenario(const std::string& argument) {
  std::error_code error;
  const std::vector<fs::path> folders = ScenarioFolders();
  if (fs::exists(argument, error) || argument.ends_with(".yaml") || IsRobotFile(argument) ||
      argument.empty() || folders.empty() || fs::path(argument).is_absolute()) {
    return argument;
  }
  for (const fs::path& folder : folders) {
    const fs::path named = folder / argument;
    if (IsFolder(named)) return named.string();
    if (IsFile(named.string() + ".yaml")) return named.string() + ".yaml";
  }
  return (folders.front() / argument).string() + ".yaml";
}

std::vector<fs::path> ScenarioFolders() {
  std::vector<fs::path> folders;
  if (IsFolder("scenarios")) folders.emplace_back("scenarios");
  const auto shipped = ShippedFolder();
  if (!shipped || !IsFolder(*shipped / "scenarios")) return folders;
  std::error_code error;
  if (folders.empty() || !fs::equivalent(folders.front(), *shipped / "scenarios", error)) {
    folders.push_back(*shipped / "scenarios");
  }
  return folders;
}

std::optional<fs::path> ShippedModels() {
  const auto folder = ShippedFolder();
  return folder ? std::optional(*folder / "models") : std::nullopt;
}

std::string Shown(const fs::path& path) {
  std::error_code error;
  const fs::path here = fs::current_path(error);
  const fs::path relative = Absolute(path).lexically_relative(here);
  if (error || relative.empty() || *relative.begin() == "..") return path.lexically_normal();
  return relative;
}

}  // namespace mbv
