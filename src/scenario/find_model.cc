#include "scenario/find_model.h"

#include <cstdlib>
#include <set>

namespace mbv {
namespace {

namespace fs = std::filesystem;

// <prefix>/share/mbverify of the running program <prefix>/bin/mbverify.
fs::path ShareFolder() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return error ? fs::path() : program.parent_path().parent_path() / "share" / "mbverify";
}

bool IsFile(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

bool IsFolder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
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
  candidates.push_back(ShareFolder() / "models");
  std::vector<fs::path> folders;
  for (const fs::path& candidate : candidates) {
    if (IsFolder(candidate)) folders.push_back(candidate);
  }
  return folders;
}

std::optional<std::string> FindModel(const std::string& name, const fs::path& start) {
  if (name.find('/') != std::string::npos || name.ends_with(".yaml")) {
    const fs::path path = fs::path(name).is_absolute() ? fs::path(name) : start / name;
    if (IsFile(path)) return Shown(path);
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

std::optional<fs::path> ScenariosFolder() {
  for (const fs::path& folder : {fs::path("scenarios"), ShareFolder() / "scenarios"}) {
    if (IsFolder(folder)) return folder;
  }
  return std::nullopt;
}

std::string Shown(const fs::path& path) {
  std::error_code error;
  const fs::path here = fs::current_path(error);
  const fs::path relative = Absolute(path).lexically_relative(here);
  if (error || relative.empty() || *relative.begin() == "..") return path.lexically_normal();
  return relative;
}

}  // namespace mbv
