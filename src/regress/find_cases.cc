#include "regress/find_cases.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>

#include "regress/files.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

bool NamesMechanism(const std::string& file) {
  const std::string text = "\n" + ReadWholeFile(file).value_or("");
  return text.find("\nmechanism:") != std::string::npos;
}

std::vector<fs::path> FilesBelow(const fs::path& folder, const std::string& extension) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(folder, error)) {
    if (!entry.is_regular_file(error)) continue;
    if (extension.empty() || entry.path().extension() == extension) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// Everything in the model's folder counts: model, URDF, meshes.
std::string InputsOf(const std::string& file, const ScenarioHead& head) {
  Fingerprint fingerprint;
  fingerprint.AddFile(file);
  const auto model = FindModel(head.mechanism, fs::path(file).parent_path());
  if (head.mechanism.empty() || !model) return fingerprint.Text();
  for (const fs::path& path : FilesBelow(fs::path(*model).parent_path(), "")) {
    fingerprint.AddFile(path);
  }
  return fingerprint.Text();
}

void AddFolder(const std::string& folder, std::vector<std::string>* files,
               std::vector<std::string>* troubles) {
  const size_t before = files->size();
  for (const fs::path& file : FilesBelow(folder, ".yaml")) {
    if (ReadScenarioHead(file).is_scenario || NamesMechanism(file)) files->push_back(file);
  }
  if (files->size() == before) troubles->push_back(folder + ": error: no scenario in this folder");
}

}  // namespace

std::string CaseKey(const std::string& file) {
  std::error_code error;
  const fs::path absolute = fs::absolute(file, error).lexically_normal();
  fs::path below;
  bool found = false;
  for (const fs::path& part : absolute.parent_path()) {
    if (part == "scenarios") {
      below.clear();
      found = true;
    } else if (found) {
      below /= part;
    }
  }
  if (!found) {
    for (const fs::path& part : fs::path(Shown(absolute)).parent_path()) {
      if (part != ".." && part != "/") below /= part;
    }
  }
  return (below / absolute.stem()).generic_string();
}

FoundCases FindCases(const std::vector<std::string>& paths) {
  FoundCases found;
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    std::error_code error;
    if (fs::is_directory(path, error)) {
      AddFolder(path, &files, &found.troubles);
    } else if (fs::is_regular_file(path, error)) {
      files.push_back(path);
    } else {
      found.troubles.push_back(path + ": error: no such file or folder");
    }
  }
  std::map<std::string, std::string> file_of;  // by key
  for (const std::string& file : files) {
    const std::string key = CaseKey(file);
    std::error_code error;
    const auto [other, is_new] = file_of.emplace(key, file);
    if (!is_new && !fs::equivalent(other->second, file, error)) {
      found.troubles.push_back(
          fmt::format("{}: error: {} would use the same name '{}'", file, other->second, key));
    }
  }
  for (const auto& [key, file] : file_of) {
    const ScenarioHead head = ReadScenarioHead(file);
    found.cases.push_back({key, file, InputsOf(file, head), head});
  }
  return found;
}

std::optional<Shard> ParseShard(const std::string& text) {
  Shard shard;
  const char* end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, shard.index);
  if (first.ec != std::errc() || first.ptr == end || *first.ptr != '/') return std::nullopt;
  const auto second = std::from_chars(first.ptr + 1, end, shard.count);
  if (second.ec != std::errc() || second.ptr != end) return std::nullopt;
  if (shard.index < 1 || shard.index > shard.count) return std::nullopt;
  return shard;
}

void KeepShard(const Shard& shard, std::vector<CaseFile>* cases) {
  std::vector<CaseFile> kept;
  for (size_t i = 0; i < cases->size(); ++i) {
    if (static_cast<int>(i % static_cast<size_t>(shard.count)) == shard.index - 1) {
      kept.push_back(std::move((*cases)[i]));
    }
  }
  *cases = std::move(kept);
}

}  // namespace mbv
