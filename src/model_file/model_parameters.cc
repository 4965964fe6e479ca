// Parameters of the model and of instances, of other files, and overrides.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "model_file/model_reader.h"

namespace mbv {
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

// The model's own parameters after those of the files it takes them from; the nearer file wins.
void ModelReader::ReadModelParameters(const Block& model, const YamlMap& map) {
  std::error_code ignored;
  OpenParameterFiles(&yaml_, *root_,
                     {std::filesystem::weakly_canonical(yaml_.file(), ignored).string()});
  struct Source {
    YamlReader* yaml;
    const YamlNode* node;
  };
  std::vector<Source> sources;
  for (ParameterFile& file : parameter_files_) {
    sources.push_back({&file.yaml, file.root->Find("parameters")});
  }
  sources.push_back({&yaml_, map.Find("parameters")});
  for (const Source& source : sources) {
    ReadParameters(source.yaml, model, source.node, "parameters");
  }
  ApplyOverrides(model);
  for (size_t i = 0; i < sources.size(); ++i) {
    std::set<std::string> replaced;
    for (size_t nearer = i + 1; nearer < sources.size(); ++nearer) {
      replaced.merge(KeysOf(sources[nearer].node));
    }
    EvaluateParameters(sources[i].yaml, model, sources[i].node, "parameters", replaced);
  }
  for (const ParameterFile& file : parameter_files_) {
    other_findings_.Append(file.yaml.diagnostics());
  }
}

// Opens the file that `root` (read by `yaml`) takes its parameters from, the files behind it first.
// `chain`: the files on the way here.
void ModelReader::OpenParameterFiles(YamlReader* yaml, const YamlNode& root,
                                     const std::vector<std::string>& chain) {
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
  ParameterFile file{.yaml = YamlReader(path.lexically_normal().string()), .root = nullptr};
  const auto text = file.yaml.ReadFile();
  if (!text) {
    yaml->Error(*node, fmt::format("parameters_from = {} cannot be read", Describe(*node)),
                "the path is relative to this file");
    return;
  }
  file.root = file.yaml.Parse(*text);
  if (file.root == nullptr || !file.root->is_map()) {
    yaml->Error(*node, fmt::format("parameters_from = {} is no model file", Describe(*node)));
    other_findings_.Append(file.yaml.diagnostics());
    return;
  }
  std::vector<std::string> longer = chain;
  longer.push_back(canonical);
  OpenParameterFiles(&file.yaml, *file.root, longer);
  parameter_files_.push_back(std::move(file));
}

void ModelReader::ReadParameters(YamlReader* yaml, const Block& block, const YamlNode* node,
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
void ModelReader::EvaluateParameters(YamlReader* yaml, const Block& block, const YamlNode* node,
                                     const std::string& path,
                                     const std::set<std::string>& replaced) {
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
    mechanism_.parameters.push_back(std::move(parameter));
  }
}

void ModelReader::ApplyOverrides(const Block& block) {
  for (const auto& [name, value] : options_.overrides) {
    if (!name.starts_with(block.prefix)) continue;
    const auto [inner, unit] =
        SplitUnit(name.substr(block.prefix.size()),
                  [&](const std::string& known) { return block.scope->Has(known); });
    if (!block.scope->Has(inner)) continue;
    block.scope->Set(inner, unit.to_si(value));
    override_used_[name] = true;
    if (const auto [other, first] = overridden_.emplace(block.prefix + inner, name); !first) {
      Finding finding = PlaceOfOverride(name);
      finding.message = fmt::format("{} and {} are both given", other->second, name);
      finding.hint = "keep one of them";
      other_findings_.Add(finding);
    }
  }
  for (const std::string& name : block.scope->Names()) {
    if (block.scope->Has(name)) known_parameters_.push_back(block.prefix + name);
  }
}

Finding ModelReader::PlaceOfOverride(const std::string& name) const {
  const auto place = options_.override_places.find(name);
  Finding finding = place == options_.override_places.end() ? Finding{} : place->second;
  finding.severity = Severity::kError;
  return finding;
}

void ModelReader::CheckOverrides() {
  for (const auto& [name, value] : options_.overrides) {
    const std::string why = WhyNoNumber(value);
    if (override_used_[name] && why.empty()) continue;
    Finding finding = PlaceOfOverride(name);
    if (override_used_[name]) {
      finding.message = fmt::format("parameter {} = {} {}", name, value, why);
    } else {
      finding.message = fmt::format("{} has no parameter '{}'", yaml_.file(), name);
      const std::string near = ClosestWord(name, known_parameters_);
      if (!near.empty()) finding.hint = fmt::format("did you mean '{}'?", near);
    }
    other_findings_.Add(finding);
  }
}

}  // namespace mbv
