#include "model_file/model_instances.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/text.h"
#include "model_file/model_names.h"

namespace mbv::internal {
namespace {

Source SourceOf(int choice) {
  return std::vector<Source>{Source::kPrinted, Source::kAssumed, Source::kCorrected}[choice];
}

std::set<std::string> KeysOf(const YamlNode* map) {
  std::set<std::string> keys;
  if (map == nullptr) return keys;
  for (const YamlEntry& entry : map->entries) keys.insert(entry.key);
  return keys;
}

}  // namespace

void ParameterReader::ReadModel(const Block& model, const YamlMap& file) {
  std::error_code ignored;
  std::deque<File> files;  // innermost base first
  if (file.Has("parameters_from")) {
    OpenFiles(&yaml_, *file.node(),
              {std::filesystem::weakly_canonical(yaml_.file(), ignored).string()}, &files);
  }
  struct Source {
    YamlReader* yaml;
    const YamlNode* node;
  };
  std::vector<Source> sources;
  sources.reserve(files.size() + 1);
  for (File& other : files) sources.push_back({&other.yaml, other.root->Find("parameters")});
  sources.push_back({&yaml_, file.Find("parameters")});
  for (const Source& source : sources) Define(source.yaml, model, source.node, "parameters");
  Override(model);
  for (size_t i = 0; i < sources.size(); ++i) {
    std::set<std::string> replaced;
    for (size_t nearer = i + 1; nearer < sources.size(); ++nearer) {
      replaced.merge(KeysOf(sources[nearer].node));
    }
    Evaluate(sources[i].yaml, model, sources[i].node, "parameters", replaced);
  }
  for (const File& other : files) others_.Append(other.yaml.diagnostics());
}

void ParameterReader::DefinePart(const Block& instance, const YamlNode* parameters) {
  Define(&yaml_, instance, parameters, instance.PathOf("parameters"));
}

void ParameterReader::FinishPart(const Block& instance, const YamlNode* parameters) {
  Override(instance);
  Evaluate(&yaml_, instance, parameters, instance.PathOf("parameters"));
}

// Opens the file that `root` (read by `yaml`) takes its parameters from, the files behind it first.
// `chain`: the files on the way here.
void ParameterReader::OpenFiles(YamlReader* yaml, const YamlNode& root,
                                const std::vector<std::string>& chain, std::deque<File>* files) {
  const YamlNode* node = root.Find("parameters_from");
  if (node == nullptr || node->is_null()) return;
  const auto name = yaml->Text(*node, "parameters_from");
  if (!name) return;
  const std::filesystem::path path = std::filesystem::path(yaml->file()).parent_path() / *name;
  std::error_code ignored;
  const std::string canonical = std::filesystem::weakly_canonical(path, ignored).string();
  if (std::find(chain.begin(), chain.end(), canonical) != chain.end()) {
    yaml->Error(*node, fmt::format("parameters_from = {} leads back to a file on the way here",
                                   Describe(*node)));
    return;
  }
  File file{.yaml = YamlReader(path.lexically_normal().string()), .root = nullptr};
  const auto text = file.yaml.ReadFile();
  if (!text) {
    yaml->Error(*node, fmt::format("parameters_from = {} cannot be read", Describe(*node)),
                "the path is relative to this file");
    return;
  }
  file.root = file.yaml.Parse(*text);
  if (file.root == nullptr || !file.root->is_map()) {
    yaml->Error(*node, fmt::format("parameters_from = {} is not a model file", Describe(*node)));
    others_.Append(file.yaml.diagnostics());
    return;
  }
  if (file.root->Find("parameters") == nullptr && file.root->Find("parameters_from") == nullptr) {
    file.yaml.RefuseForeign(*file.root, "the file is of another kind: it has no 'parameters'", "");
  }
  std::vector<std::string> longer = chain;
  longer.push_back(canonical);
  OpenFiles(&file.yaml, *file.root, longer, files);
  files->push_back(std::move(file));
}

void ParameterReader::Define(YamlReader* yaml, const Block& block, const YamlNode* node,
                             const std::string& path) {
  if (node == nullptr) return;
  for (const YamlEntry& entry : yaml->Entries(*node, path)) {
    if (const ParameterText* known = Known(entry)) {
      block.scope->Define(entry.key, known->value->text, known->in_unit);
      continue;
    }
    const std::string where = JoinPath(path, entry.key);
    if (const std::string why = InvalidNameReason(entry.key); !why.empty()) {
      yaml->Error(entry, fmt::format("{}: bad parameter name '{}'", path, entry.key), why);
      continue;
    }
    const YamlNode* value = entry.value.get();
    UnitSuffix unit = kPlain;
    if (value->is_map()) {
      const YamlMap map(yaml, value, where,
                        {"value", "value_deg", "value_mm", "unit", "source", "note"});
      const auto found = map.FindInUnit("value", {kPlain, kDeg, kMm});
      if (found.node == nullptr) (void)map.Required("value");
      value = found.node;
      unit = found.unit;
    }
    if (value == nullptr) continue;
    if (!value->is_scalar()) {
      yaml->Error(*value, fmt::format("{} is {}, a number or an expression is needed", where,
                                      Describe(*value)));
      continue;
    }
    block.scope->Define(entry.key, value->text, unit);
  }
}

// Reports what fails, and lists the parameters in the mechanism but those that another file
// replaces.
void ParameterReader::Evaluate(YamlReader* yaml, const Block& block, const YamlNode* node,
                               const std::string& path, const std::set<std::string>& replaced) {
  if (node == nullptr || !node->is_map()) return;
  for (const YamlEntry& entry : node->entries) {
    if (!block.scope->Has(entry.key) || replaced.count(entry.key) > 0) continue;
    const ExpressionResult result = block.scope->Lookup(entry.key);
    const size_t findings = yaml->diagnostics().findings().size();
    const ParameterText* known = Known(entry);
    const ParameterText text = known != nullptr ? *known : ReadText(yaml, entry, path);
    if (!result.value && !result.error.empty()) {
      yaml->Error(
          *text.value,
          fmt::format("{} = {} {}", JoinPath(path, entry.key), Describe(*text.value), result.error),
          result.hint);
    }
    parameters_.push_back({.name = block.prefix + entry.key,
                           .value = result.value.value_or(kNan),
                           .unit = text.unit,
                           .source = text.source,
                           .note = text.note,
                           .written_out = text.written_out && !Contains(block.given, entry.key)});
    const bool good = yaml->diagnostics().findings().size() == findings;
    if (known == nullptr && good && known_texts_ != nullptr && yaml == &yaml_) {
      known_texts_->emplace(&entry, text);
    }
  }
}

// Of a file whose tree is not kept nothing is known.
const ParameterText* ParameterReader::Known(const YamlEntry& entry) const {
  if (known_texts_ == nullptr) return nullptr;
  const auto found = known_texts_->find(&entry);
  return found == known_texts_->end() ? nullptr : &found->second;
}

ParameterText ParameterReader::ReadText(YamlReader* yaml, const YamlEntry& entry,
                                        const std::string& path) {
  ParameterText text{.value = entry.value.get(), .unit = "", .note = ""};
  if (entry.value->is_map()) {
    const YamlMap map(yaml, entry.value.get(), JoinPath(path, entry.key),
                      {"value", "value_deg", "value_mm", "unit", "source", "note"});
    if (const auto found = map.FindInUnit("value", {kPlain, kDeg, kMm}); found.node != nullptr) {
      text.value = found.node;
      text.in_unit = found.unit;
    }
    if (const YamlNode* unit = map.Find("unit")) {
      text.unit = yaml->Text(*unit, map.PathOf("unit")).value_or("");
    }
    if (const YamlNode* note = map.Find("note")) {
      text.note = yaml->Text(*note, map.PathOf("note")).value_or("");
    }
    if (const YamlNode* source = map.Find("source")) {
      const auto choice =
          yaml->Choice(*source, map.PathOf("source"), {"printed", "assumed", "corrected"});
      if (choice) text.source = SourceOf(*choice);
    }
  }
  text.written_out = IsWrittenOut(text.value->text);
  return text;
}

void ParameterReader::Override(const Block& block) {
  for (const auto& [name, value] : options_.overrides) {
    if (!name.starts_with(block.prefix)) continue;
    const auto [inner, unit] =
        SplitUnit(name.substr(block.prefix.size()),
                  [&](const std::string& known) { return block.scope->Has(known); });
    if (!block.scope->Has(inner)) continue;
    block.scope->Set(inner, unit.to_si(value));
    used_overrides_.insert(name);
    if (const auto [other, first] = overridden_.emplace(block.prefix + inner, name); !first) {
      Finding finding = PlaceOfOverride(name);
      finding.message = fmt::format("{} and {} are both given", other->second, name);
      finding.hint = "keep one of them";
      others_.Add(finding);
    }
  }
  scopes_.emplace_back(block.scope, block.prefix);
}

Finding ParameterReader::PlaceOfOverride(const std::string& name) const {
  const auto place = options_.override_places.find(name);
  Finding finding = place == options_.override_places.end() ? Finding{} : place->second;
  finding.severity = Severity::kError;
  return finding;
}

void ParameterReader::CheckOverrides() {
  for (const auto& [name, value] : options_.overrides) {
    const std::string why = NotANumberReason(value);
    const bool used = used_overrides_.contains(name);
    if (used && why.empty()) continue;
    Finding finding = PlaceOfOverride(name);
    if (used) {
      finding.message = fmt::format("parameter {} = {} {}", name, value, why);
    } else {
      finding.message = fmt::format("{} has no parameter '{}'", yaml_.file(), name);
      std::vector<std::string> known;  // dotted names
      for (const auto& [scope, prefix] : scopes_) {
        for (const std::string& own : scope->Names()) {
          if (scope->Has(own)) known.push_back(prefix + own);
        }
      }
      finding.hint = DidYouMean(name, known);
    }
    others_.Add(finding);
  }
}

namespace {

const std::vector<std::string> kPartKeys = {"parameters", "attach",      "bodies",    "joints",
                                            "drives",     "prescribed",  "outputs",   "springs",
                                            "instances",  "description", "materials", "sections",
                                            "couplings",  "elements",    "legs",      "contacts"};

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
