// What the loaders of all kinds of scenario files do alike. Internal to scenario/.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "core/diagnostics.h"
#include "input/value_reader.h"
#include "input/yaml_reader.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "scenario/file_parts.h"
#include "scenario/load_scenario.h"
#include "scenario/set_values.h"

namespace mbv::internal {

/// Text → `Result`: a scenario (`Content`), its mechanism and all findings. A kind of scenario
/// brings Read().
template <typename Content, typename Result>
class ScenarioFile {
 public:
  ScenarioFile(const std::string& file, const ScenarioOptions& options)
      : file_(file), options_(options), yaml_(file), values_(&yaml_, &scope_) {}
  virtual ~ScenarioFile() = default;

  Result Load(const std::string& text) {
    YamlNodePtr root = yaml_.Parse(text);
    if (root != nullptr) root = SetValues(root, options_.set, &yaml_);
    if (root != nullptr) Read(*root);
    Result result;
    result.diagnostics = PlaceSetFindings(yaml_.diagnostics(), options_.set);
    result.diagnostics.Append(model_findings_);
    result.diagnostics.Append(table_findings_);
    if (result.diagnostics.has_errors() || !mechanism_) return result;
    result.scenario = std::move(scenario_);
    result.mechanism = std::move(mechanism_);
    return result;
  }

  Result LoadFile() {
    from_file_ = true;
    const auto text = yaml_.ReadFile();
    if (text) return Load(*text);
    return {{}, {}, yaml_.diagnostics()};
  }

 protected:
  /// Fills scenario_ and mechanism_; findings go to yaml_.
  virtual void Read(const YamlNode& root) = 0;

  void ReadDescription(const YamlMap& map) {
    if (const YamlNode* description = map.Find("description")) {
      scenario_.description = yaml_.Text(*description, "description").value_or("");
    }
  }

  /// Loads scenario_.model_file; its parameters are in scope from then on.
  void LoadModelWith(const LoadOptions& options) {
    LoadResult loaded = LoadModel(scenario_.model_file, options);
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
  YamlReader yaml_;
  Scope scope_;
  ValueReader values_;
  Diagnostics model_findings_, table_findings_;
  Content scenario_;
  std::optional<Mechanism> mechanism_;
};

}  // namespace mbv::internal
