// Parts of scenario files that all kinds of scenarios share.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "model_file/yaml/value_reader.h"
#include "model_file/yaml/yaml_reader.h"
#include "scenario/load_scenario.h"

namespace mbv {

/// "sea_state", or "must_fail/wrong_mass" for a file in a folder below one named as the mechanism.
[[nodiscard]] std::string CaseName(const std::filesystem::path& file, const std::string& mechanism);

/// A finding if a part of a scenario's name breaks the rule of names (base/files.h): it becomes a
/// folder.
void CheckCaseName(const std::string& name, YamlReader* yaml);

/// Where each entry of a map was written: in `file`, or on the command line by --set.
[[nodiscard]] std::map<std::string, Finding> PlacesOf(const YamlNode& map, const std::string& file,
                                                      const std::vector<SetValue>& set);

/// The parameter of the mechanism that a name in a file means, with its unit.
[[nodiscard]] NameInUnit PlainName(const std::string& name, const Mechanism& mechanism);
/// Overrides whose names may end in a unit, by the parameters' own names in SI.
[[nodiscard]] Overrides InPlainUnits(const Overrides& overrides, const Mechanism& mechanism);

/// A finding if the mechanism has no parameter of this name; `path` names the section.
void CheckParameterName(const YamlEntry& entry, const std::string& path, const Mechanism& mechanism,
                        YamlReader* yaml);

/// `on`, `off`, `none` (and what YAML 1.1 users write for them); empty for anything else.
[[nodiscard]] std::optional<bool> AsSwitch(const YamlNode& node);

}  // namespace mbv

// What the loaders of all kinds of scenario files do alike. Internal to scenario/.

namespace mbv::internal {

/// Text → `Result`: a scenario (`Content`), its mechanism and all findings. A kind of scenario
/// brings Read().
template <typename Content, typename Result>
class ScenarioFile {
 public:
  ScenarioFile(const std::string& file, const ScenarioOptions& options,
               ScenarioMemory* memory = nullptr)
      : file_(file), options_(options), memory_(memory), yaml_(file), values_(&yaml_, &scope_) {}
  virtual ~ScenarioFile() = default;

  Result Load(const std::string& text) { return Load(yaml_.Parse(text)); }

  Result LoadFile() {
    from_file_ = true;
    if (memory_ != nullptr) return Load(memory_->Document(&yaml_));
    const auto text = yaml_.ReadFile();
    if (text) return Load(*text);
    return {{}, {}, yaml_.diagnostics()};
  }

 protected:
  /// Fills scenario_ and mechanism_; findings go to yaml_.
  virtual void Read(const YamlNode& root) = 0;

  Result Load(YamlNodePtr root) {
    if (root != nullptr) {
      root = memory_ != nullptr ? memory_->Set(root, options_.set, &yaml_)
                                : SetValues(root, options_.set, &yaml_);
      Read(*root);
    }
    Result result;
    result.diagnostics = PlaceSetFindings(yaml_.diagnostics(), options_.set);
    result.diagnostics.Append(model_findings_);
    result.diagnostics.Append(table_findings_);
    if (result.diagnostics.has_errors() || !mechanism_) return result;
    result.scenario = std::move(scenario_);
    result.mechanism = std::move(mechanism_);
    return result;
  }

  void ReadDescription(const YamlMap& map) {
    if (const YamlNode* description = map.Find("description")) {
      scenario_.description = yaml_.Text(*description, "description").value_or("");
    }
  }

  /// Overrides for all witnesses, and where each was written.
  void ReadParameters(const YamlNode* node) {
    scenario_.parameters = ReadOverrides(&values_, node, "parameters");
    if (node == nullptr) return;
    scenario_.parameter_places = PlacesOf(*node, file_, options_.set);
    // What an option sets in one unit replaces what the file gives in another.
    for (const YamlEntry& option : node->entries) {
      if (option.line >= 0) continue;
      for (const YamlEntry& entry : node->entries) {
        if (entry.line < 0 || SplitUnit(entry.key).name != SplitUnit(option.key).name) continue;
        scenario_.parameters.erase(entry.key);
      }
    }
  }

  /// Loads scenario_.model_file; its parameters are in scope from then on.
  void LoadModelWith(const LoadOptions& options) {
    LoadResult loaded = memory_ != nullptr ? memory_->Load(scenario_.model_file, options)
                                           : LoadModel(scenario_.model_file, options);
    model_findings_ = loaded.diagnostics;
    // Wrong overrides alone must not hide what else is wrong with the scenario.
    if (!loaded.mechanism && !options.overrides.empty()) {
      loaded = LoadModel(scenario_.model_file);
    }
    mechanism_ = std::move(loaded.mechanism);
    scenario_.model_caveats = std::move(loaded.caveats);
    if (!mechanism_) return;
    for (const Parameter& p : mechanism_->parameters) scope_.Set(p.name, p.value);
  }

  void NameTheCase() {
    scenario_.name = CaseName(file_, mechanism_->name);
    if (from_file_) CheckCaseName(scenario_.name, &yaml_);
  }

  /// Parameters given in degrees or millimetres: what follows knows SI only.
  void UseSiOverrides() {
    for (Overrides* overrides :
         {&scenario_.parameters, &scenario_.analytic.parameters, &scenario_.reference.parameters,
          &scenario_.simulation.parameters}) {
      *overrides = InPlainUnits(*overrides, *mechanism_);
    }
  }

  /// Overrides of single witnesses must name parameters of the model, too.
  void CheckWitnessParameters(const YamlMap& map) {
    for (const char* section : {"analytic", "reference", "simulation"}) {
      const YamlNode* node = map.Find(section);
      const YamlNode* parameters = node == nullptr ? nullptr : node->Find("parameters");
      if (parameters == nullptr) continue;
      for (const YamlEntry& entry : parameters->entries) {
        CheckParameterName(entry, std::string(section) + ".parameters", *mechanism_, &yaml_);
      }
    }
  }

  std::string file_;
  bool from_file_ = false;  // and not a made-up name
  const ScenarioOptions& options_;
  ScenarioMemory* memory_;  // null: everything is loaded anew
  YamlReader yaml_;
  Scope scope_;
  ValueReader values_;
  Diagnostics model_findings_, table_findings_;
  Content scenario_;
  std::optional<Mechanism> mechanism_;
};

}  // namespace mbv::internal
