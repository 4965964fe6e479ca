#include "model_file/model_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/text.h"

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
  OpenFiles(&yaml_, *file.node(),
            {std::filesystem::weakly_canonical(yaml_.file(), ignored).string()}, &files);
  struct Source {
    YamlReader* yaml;
    const YamlNode* node;
  };
  std::vector<Source> sources;
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
    yaml->Error(*node, fmt::format("parameters_from = {} is no model file", Describe(*node)));
    others_.Append(file.yaml.diagnostics());
    return;
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
    const std::string where = JoinPath(path, entry.key);
    if (const std::string why = WhyNoParameterName(entry.key); !why.empty()) {
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
    const std::string where = JoinPath(path, entry.key);
    Parameter parameter{.name = block.prefix + entry.key, .unit = "", .note = ""};
    const ExpressionResult result = block.scope->Lookup(entry.key);
    if (result.value) parameter.value = *result.value;
    const YamlNode* at = entry.value.get();
    if (at->is_map()) {
      const YamlMap map(yaml, at, where,
                        {"value", "value_deg", "value_mm", "unit", "source", "note"});
      if (const auto found = map.FindInUnit("value", {kPlain, kDeg, kMm}); found.node != nullptr) {
        at = found.node;
      }
      if (const YamlNode* unit = map.Find("unit")) {
        parameter.unit = yaml->Text(*unit, map.PathOf("unit")).value_or("");
      }
      if (const YamlNode* note = map.Find("note")) {
        parameter.note = yaml->Text(*note, map.PathOf("note")).value_or("");
      }
      if (const YamlNode* source = map.Find("source")) {
        const auto choice =
            yaml->Choice(*source, map.PathOf("source"), {"printed", "assumed", "corrected"});
        if (choice) parameter.source = SourceOf(*choice);
      }
    }
    if (!result.value && !result.error.empty()) {
      yaml->Error(*at, fmt::format("{} = {} {}", where, Describe(*at), result.error), result.hint);
    }
    parameter.written_out = IsWrittenOut(at->text) && !Contains(block.given, entry.key);
    parameters_.push_back(std::move(parameter));
  }
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
  for (const std::string& name : block.scope->Names()) {
    if (block.scope->Has(name)) known_.push_back(block.prefix + name);
  }
}

Finding ParameterReader::PlaceOfOverride(const std::string& name) const {
  const auto place = options_.override_places.find(name);
  Finding finding = place == options_.override_places.end() ? Finding{} : place->second;
  finding.severity = Severity::kError;
  return finding;
}

void ParameterReader::CheckOverrides() {
  for (const auto& [name, value] : options_.overrides) {
    const std::string why = WhyNoNumber(value);
    const bool used = used_overrides_.contains(name);
    if (used && why.empty()) continue;
    Finding finding = PlaceOfOverride(name);
    if (used) {
      finding.message = fmt::format("parameter {} = {} {}", name, value, why);
    } else {
      finding.message = fmt::format("{} has no parameter '{}'", yaml_.file(), name);
      finding.hint = DidYouMean(name, known_);
    }
    others_.Add(finding);
  }
}

}  // namespace mbv::internal
