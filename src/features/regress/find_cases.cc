#include "features/regress/find_cases.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <map>

#include "base/files.h"
#include "base/json_text.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "features/stiffness/stiffness_scenario.h"
#include "scenario/find_model.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kHeadTimeout_s = 30.0;

bool NamesMechanism(const std::string& text) {
  return ("\n" + text).find("\nmechanism:") != std::string::npos;
}

// Runs in a child: what the parent has to know of a file.
std::string HeadJson(const std::string& file) {
  const std::string text = ReadWholeFile(file).value_or("");
  const ScenarioHead head = ReadScenarioHead(file);
  const std::string folder = fs::path(file).parent_path().string();
  const auto model = FindModel(head.mechanism, folder);
  const auto found = FindElasticModel(head.mechanism, folder);
  const std::string* elastic = std::get_if<std::string>(&found);
  Fingerprint fingerprint;
  fingerprint.Add(fs::path(file).filename().string());
  fingerprint.Add(text);
  const DocumentKind& kind = KindOf(file);
  const Json json = {{"counts", kind.runs() || NamesMechanism(text)},
                     {"command", kind.runs() ? kind.command : "run"},
                     {"kind", head.kind},
                     {"witnesses", head.names_programs},
                     {"mechanism", head.mechanism},
                     {"description", head.description},
                     {"verdict", head.expect.verdict},
                     {"exit_code", head.expect.exit_code},
                     {"mentions", head.expect.mentions},
                     {"inputs", fingerprint.Text()},
                     {"models", model.value_or("") + "\n" + (elastic == nullptr ? "" : *elastic)}};
  return DumpLine(json);
}

struct Found {
  bool counts = true;  // as a scenario or study
  CaseFile file;
};

// A file that cannot be read to its end counts: its worker will say why.
Found FoundOf(const std::string& file, const std::optional<std::string>& text) {
  Found found;
  found.file.file = file;
  const Json json = text ? ParseIfJson<Json>(*text) : Json();
  if (!json.is_object()) return found;
  ScenarioHead& head = found.file.head;
  found.counts = json.value("counts", true);
  found.file.command = json.value("command", "run");
  head.kind = json.value("kind", "");
  head.names_programs = json.value("witnesses", false);
  head.mechanism = json.value("mechanism", "");
  head.description = json.value("description", "");
  head.expect.verdict = json.value("verdict", "agree");
  head.expect.exit_code = json.value("exit_code", 0);
  head.expect.mentions = json.value("mentions", "");
  found.file.inputs = json.value("inputs", "");
  found.file.models = json.value("models", "");
  return found;
}

// Reads the heads of `files`; a folder's files count only if they are scenarios or studies.
void AddFiles(const std::vector<std::string>& files, bool all, std::vector<CaseFile>* cases) {
  const auto texts =
      InChildren(files.size(), kHeadTimeout_s, [&](size_t i) { return HeadJson(files[i]); });
  for (size_t i = 0; i < files.size(); ++i) {
    Found found = FoundOf(files[i], texts[i]);
    if (all || found.counts) cases->push_back(std::move(found.file));
  }
}

void AddPath(const std::string& given, std::vector<CaseFile>* cases, FoundCases* found) {
  const std::string path = FindScenario(given);
  std::error_code error;
  if (fs::is_regular_file(path, error)) {
    AddFiles({path}, true, cases);
    return;
  }
  if (!fs::is_directory(path, error)) {
    found->troubles.push_back(path + ": error: no such file or folder");
    const std::string hint = DidYouMeanPath(path);
    if (!hint.empty()) found->troubles.back() += "\n  hint: " + hint;
    return;
  }
  const size_t before = cases->size(), unread = found->unread.size();
  AddFiles(FilesBelow(path, ".yaml", &found->unread), false, cases);
  if (cases->size() > before) return;
  // Nothing was found; what could not be read may be why.
  found->troubles.insert(found->troubles.end(), found->unread.begin() + static_cast<long>(unread),
                         found->unread.end());
  found->troubles.push_back(path + ": error: no scenario in this folder");
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
  return NearestPlainPath((below / absolute.stem()).generic_string());
}

FoundCases FindCases(const std::vector<std::string>& paths) {
  FoundCases found;
  std::vector<CaseFile> cases;
  for (const std::string& path : paths) AddPath(path, &cases, &found);
  std::map<std::string, CaseFile> by_key;
  for (CaseFile& file : cases) {
    file.key = CaseKey(file.file);
    const std::string name = file.file;
    std::error_code error;
    const auto [other, is_new] = by_key.emplace(file.key, file);
    if (!is_new && !fs::equivalent(other->second.file, name, error)) {
      found.troubles.push_back(fmt::format("{}: error: {} would use the same name '{}'", name,
                                           other->second.file, file.key));
    }
  }
  for (auto& [key, file] : by_key) found.cases.push_back(std::move(file));
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
