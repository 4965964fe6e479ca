#include "model_file/model_instances.h"

#include <fmt/format.h>

#include <algorithm>

#include "model_file/model_names.h"

namespace mbv::internal {
namespace {

const std::vector<std::string> kPartKeys = {"parameters", "attach",      "bodies",    "joints",
                                            "drives",     "prescribed",  "outputs",   "springs",
                                            "instances",  "description", "materials", "sections",
                                            "couplings",  "elements",    "legs"};

}  // namespace

ModelBlocks::ModelBlocks(const YamlNode* root) {
  blocks.push_back({.node = root,
                    .scope = &scopes.emplace_back(),
                    .path = "",
                    .prefix = "",
                    .levels = {""},
                    .parts = {},
                    .given = {}});
}

const YamlNode* Block::Section(std::string_view key) const {
  const YamlNode* found = node == nullptr ? nullptr : node->Find(key);
  return found == nullptr || found->is_null() ? nullptr : found;
}

const std::vector<YamlEntry>& Block::Entries(const char* section, YamlReader* yaml) const {
  static const std::vector<YamlEntry> none;
  const YamlNode* found = Section(section);
  return found == nullptr ? none : yaml->Entries(*found, PathOf(section));
}

std::string Block::Note() const {
  return prefix.empty() ? "" : fmt::format(" (in {})", prefix.substr(0, prefix.size() - 1));
}

const YamlNode* InstanceReader::FindPart(const std::string& name) const {
  return parts_ == nullptr || !parts_->is_map() ? nullptr : parts_->Find(name);
}

void InstanceReader::Expand(const Block& block) {
  for (const YamlEntry& entry : block.Entries("instances", &values_.yaml())) {
    values_.yaml().SetNote(block.Note());
    Add(block, entry);
  }
}

void InstanceReader::Add(const Block& block, const YamlEntry& entry) {
  YamlReader& yaml = values_.yaml();
  const std::string path = JoinPath(block.PathOf("instances"), entry.key);
  if (!IsNewName(entry, block.PathOf("instances"), &yaml)) return;
  if (!HasRoom(*entry.value, blocks_.blocks.size(), kMaxBlocks, "instances", &yaml)) return;
  if (!entry.value->is_map()) {
    yaml.Error(*entry.value,
               fmt::format("{} is {}, a map with 'part' is needed", path, Describe(*entry.value)));
    return;
  }
  const YamlNode* named = entry.value->Find("part");
  if (named == nullptr) {
    yaml.Error(*entry.value, fmt::format("{}: 'part' is missing", path));
    return;
  }
  const auto part_name = yaml.Text(*named, JoinPath(path, "part"));
  if (!part_name) return;
  const YamlNode* part = FindPart(*part_name);
  if (part == nullptr) {
    std::vector<std::string> names;
    if (parts_ != nullptr) {
      for (const YamlEntry& known : parts_->entries) names.push_back(known.key);
    }
    yaml.Error(*named, fmt::format("{}.part = '{}': there is no such part", path, *part_name),
               DidYouMean(*part_name, names));
    return;
  }
  if (std::find(block.parts.begin(), block.parts.end(), *part_name) != block.parts.end()) {
    yaml.Error(*named, fmt::format("{}: part '{}' contains itself", path, *part_name));
    return;
  }
  Read(block, entry, *part, *part_name);
}

void InstanceReader::Read(const Block& block, const YamlEntry& entry, const YamlNode& part,
                          const std::string& part_name) {
  YamlReader& yaml = values_.yaml();
  const std::string path = JoinPath(block.PathOf("instances"), entry.key);
  Block inner;
  inner.node = &part;
  inner.scope = &blocks_.scopes.emplace_back(block.scope);
  inner.path = JoinPath("parts", part_name);
  inner.prefix = block.prefix + entry.key + ".";
  inner.levels = block.levels;
  inner.levels.insert(inner.levels.begin(), inner.prefix);
  inner.parts = block.parts;
  inner.parts.push_back(part_name);

  yaml.SetNote(inner.Note());
  const YamlMap map(&yaml, &part, inner.path, kPartKeys);
  const YamlNode* parameters = map.Find("parameters");
  parameters_.DefinePart(inner, parameters);

  // The instance's values replace the defaults; they see the parameters where they are written.
  yaml.SetNote(block.Note());
  for (const YamlEntry& given : entry.value->entries) {
    if (given.key == "part") continue;
    if (!inner.scope->Has(given.key)) {
      yaml.Error(given,
                 fmt::format("{}: part '{}' has no parameter '{}'", path, part_name, given.key),
                 DidYouMean(given.key, inner.scope->Names()));
      continue;
    }
    const auto value = values_.Number(block, *given.value, JoinPath(path, given.key));
    inner.scope->Set(given.key, value.value_or(0.0));
    inner.given.push_back(given.key);
  }
  yaml.SetNote(inner.Note());
  parameters_.FinishPart(inner, parameters);
  blocks_.blocks.push_back(inner);
  // A copy: the list grows while the nested instances are added.
  Expand(inner);
}

}  // namespace mbv::internal
