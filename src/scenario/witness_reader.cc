#include "scenario/witness_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "core/files.h"
#include "core/inputs.h"
#include "core/roles.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kLimitWords = {"exact", "stepped"};

bool IsPlainName(const std::string& name) {
  const auto plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !name.empty() && std::all_of(name.begin(), name.end(), plain);
}

class WitnessReader {
 public:
  WitnessReader(ValueReader* values, std::string folder)
      : values_(values), yaml_(values->yaml()), folder_(std::move(folder)) {}

  std::optional<ForeignWitness> Read(const YamlEntry& entry) {
    const std::string path = JoinPath("witnesses", entry.key);
    if (!CheckName(entry, path)) return {};
    const YamlMap map(
        &yaml_, entry.value.get(), path,
        {"command", "limits", "force_nrmse", "required", "timeout_s", "memory_mb", "output_mb"});
    const YamlNode* command = map.valid() ? map.Required("command") : nullptr;
    if (command == nullptr) return {};
    ForeignWitness witness;
    witness.name = entry.key;
    const auto words = yaml_.Items(*command, map.PathOf("command"));
    if (!words) return {};
    if (words->empty()) yaml_.Error(*command, map.PathOf("command") + " is empty");
    for (const YamlNode* word : *words) {
      const auto text = yaml_.Text(*word, map.PathOf("command"));
      if (!text) return {};
      witness.command.push_back(Found(*text));
    }
    witness.typed = std::ranges::all_of(*words, [](const auto* word) { return word->line < 0; });
    witness.line = std::max(0, command->line);
    ReadLimits(map, &witness);
    return witness;
  }

 private:
  bool CheckName(const YamlEntry& entry, const std::string& path) {
    if (FindRole(entry.key) != nullptr) {
      yaml_.Error(entry, path + ": this is the name of one of our own witnesses");
      return false;
    }
    if (IsPlainName(entry.key)) return true;
    yaml_.Error(entry, path + ": letters, digits and _ make a witness' name");
    return false;
  }

  // A file beside the scenario, else the word itself: a program in the path, or an option.
  [[nodiscard]] std::string Found(const std::string& word) const {
    const fs::path beside = fs::path(folder_) / word;
    std::error_code error;
    if (word.empty() || !fs::is_regular_file(beside, error)) return word;
    NoteInput(beside.string(), ReadWholeFile(beside).value_or(""));
    return fs::absolute(beside, error).lexically_normal().string();
  }

  void ReadLimits(const YamlMap& map, ForeignWitness* witness) {
    if (const YamlNode* node = map.Find("limits")) {
      const auto choice = yaml_.Choice(*node, map.PathOf("limits"), kLimitWords);
      if (choice == 1) witness->limits = LimitColumn::kForward;
    }
    if (const YamlNode* node = map.Find("force_nrmse")) {
      witness->force_nrmse = values_->Positive(*node, map.PathOf("force_nrmse"));
    }
    if (const YamlNode* node = map.Find("required")) {
      witness->required = yaml_.Flag(*node, map.PathOf("required")).value_or(false);
    }
    const std::pair<const char*, double*> amounts[] = {{"timeout_s", &witness->timeout_s},
                                                       {"memory_mb", &witness->memory_mb},
                                                       {"output_mb", &witness->output_mb}};
    for (const auto& [key, amount] : amounts) {
      const YamlNode* node = map.Find(key);
      if (node != nullptr) *amount = values_->Positive(*node, map.PathOf(key)).value_or(*amount);
    }
  }

  ValueReader* values_;
  YamlReader& yaml_;
  std::string folder_;
};

}  // namespace

std::vector<ForeignWitness> ReadWitnesses(ValueReader* values, const YamlNode* node,
                                          const std::string& folder) {
  std::vector<ForeignWitness> witnesses;
  if (node == nullptr || node->is_null()) return witnesses;
  WitnessReader reader(values, folder);
  for (const YamlEntry& entry : values->yaml().Entries(*node, "witnesses")) {
    if (auto witness = reader.Read(entry)) witnesses.push_back(std::move(*witness));
  }
  return witnesses;
}

}  // namespace mbv
