#include "scenario/stiffness_scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/text.h"
#include "core/word_hints.h"
#include "model_file/load_model.h"
#include "scenario/coordinate_names.h"
#include "scenario/file_parts.h"
#include "scenario/motion_reader.h"
#include "scenario/scenario_file.h"
#include "scenario/settings_reader.h"
#include "scenario/stiffness_settings.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

const std::vector<std::string> kStiffnessScenarioKeys = {
    "kind",      "mechanism",  "description", "parameters",      "pose",   "output", "analytic",
    "reference", "simulation", "loads",       "compare_printed", "checks", "expect"};

class StiffnessLoader final
    : public internal::ScenarioFile<StiffnessScenario, StiffnessScenarioResult> {
 public:
  using ScenarioFile::ScenarioFile;

 private:
  void Read(const YamlNode& root) override {
    YamlMap map(&yaml_, &root, "", kStiffnessScenarioKeys);
    scenario_.file = file_;
    if (const YamlNode* kind = map.Required("kind")) {
      (void)yaml_.Choice(*kind, "kind", {"stiffness"});
    }
    ReadDescription(map);
    if (const YamlNode* parameters = map.Find("parameters")) {
      scenario_.parameters = ReadOverrides(&values_, parameters, "parameters");
      scenario_.parameter_places = PlacesOf(*parameters, file_, options_.set);
    }
    if (const YamlNode* mechanism = map.Required("mechanism")) LoadMechanism(*mechanism);
    ReadSettings(map);
    if (!mechanism_) return;
    UseSiOverrides();
    if (const YamlNode* pose = map.Find("pose")) ReadPose(*pose);
    if (const YamlNode* output = map.Find("output")) ReadOutput(*output);
    if (mechanism_) CheckWitnessParameters(map);
    if (!scenario_.analytic.on && !scenario_.reference.on && !scenario_.simulation.on) {
      yaml_.Error(root, "analytic, reference and simulation are all off");
    }
  }

  void LoadMechanism(const YamlNode& node) {
    const auto name = yaml_.Text(node, "mechanism");
    if (!name) return;
    std::string why;
    const auto model = FindElasticModel(*name, fs::path(file_).parent_path().string(), &why);
    if (!model) {
      const size_t hint = why.find("; ");
      yaml_.Error(node, fmt::format("mechanism = '{}': {}", *name, why.substr(0, hint)),
                  hint == std::string::npos ? "" : why.substr(hint + 2));
      return;
    }
    scenario_.model_file = *model;
    LoadWith(scenario_.parameters);
    if (!mechanism_) return;
    NameTheCase();
    if (mechanism_->beams.empty() && !HasServos()) {
      yaml_.Error(node, fmt::format("mechanism: {} is rigid: it has no beams and no drive with a "
                                    "stiffness",
                                    *model));
    }
  }

  void LoadWith(const Overrides& overrides) {
    LoadOptions options;
    options.overrides = overrides;
    options.override_places = scenario_.parameter_places;
    LoadModelWith(options);
  }

  bool HasServos() const {
    return std::any_of(mechanism_->drives.begin(), mechanism_->drives.end(),
                       [](const Drive& drive) { return std::isfinite(drive.stiffness); });
  }

  void ReadSettings(const YamlMap& map) {
    scenario_.analytic = ReadAnalytic(&values_, map.Find("analytic"));
    if (!scenario_.analytic.as_printed.empty()) {
      yaml_.Error(*map.Find("analytic"), "analytic.as_printed: stiffness models have no errata",
                  "analytic: {model: as_printed} takes the whole of the paper's own model");
    }
    scenario_.reference = ReadStiffnessReference(&values_, map.Find("reference"));
    scenario_.simulation = ReadStiffnessSimulation(&values_, map.Find("simulation"));
    scenario_.loads = ReadStiffnessLoads(&values_, map.Find("loads"), &scenario_.loads_text);
    scenario_.checks = ReadStiffnessChecks(&values_, map.Find("checks"));
    scenario_.expect = ReadExpectation(&values_, map.Find("expect"));
    if (const YamlNode* printed = map.Find("compare_printed")) {
      scenario_.compare_printed = yaml_.Flag(*printed, "compare_printed").value_or(false);
    }
  }

  // Coordinates of the pose, and parameters of the model that belong to it.
  void ReadPose(const YamlNode& node) {
    if (node.is_scalar() && node.text == "home") return;
    const std::vector<std::string> coordinates = CoordinateNames(*mechanism_);
    Overrides parameters;
    for (const YamlEntry& entry : yaml_.Entries(node, "pose")) {
      const auto [name, unit] = SplitUnit(entry.key);
      const auto number = values_.Number(*entry.value, JoinPath("pose", entry.key));
      const bool coordinate = Contains(coordinates, name);
      const bool parameter = mechanism_->HasParameter(name);
      if (!coordinate && !parameter) {
        UnknownName(entry, name, coordinates);
        continue;
      }
      if (scenario_.pose.contains(name) || parameters.contains(name)) {
        yaml_.Error(entry, fmt::format("pose: {} is given twice", name));
      }
      if (!number) continue;
      if (coordinate) scenario_.pose[name] = unit.to_si(*number);
      if (parameter) parameters[name] = unit.to_si(*number);
      if (parameter)
        scenario_.parameter_places[name] = PlacesOf(node, file_, options_.set)[entry.key];
    }
    if (!parameters.empty()) {
      scenario_.parameters = Merge(scenario_.parameters, parameters);
      LoadWith(scenario_.parameters);
    }
    if (!mechanism_ || yaml_.has_errors() || scenario_.pose.empty()) return;
    const PoseFault fault = CheckPose(*mechanism_, scenario_.pose);
    if (!fault.message.empty()) yaml_.Error(node, fault.message, fault.hint);
  }

  void UnknownName(const YamlEntry& entry, const std::string& name,
                   std::vector<std::string> known) {
    for (const Parameter& p : mechanism_->parameters) known.push_back(p.name);
    yaml_.Error(entry,
                fmt::format("pose: {} has no coordinate or parameter '{}'", mechanism_->name, name),
                DidYouMean(name, known,
                           "known: drives, OUTPUT.x … OUTPUT.yaw, and the model's parameters"));
  }

  void ReadOutput(const YamlNode& node) {
    std::vector<std::string> names;
    for (const Output& output : mechanism_->outputs) names.push_back(output.name);
    const auto choice = yaml_.Choice(node, "output", names);
    if (choice) scenario_.output = names[static_cast<size_t>(*choice)];
  }
};

}  // namespace

StiffnessScenarioResult LoadStiffnessScenario(const std::string& file,
                                              const ScenarioOptions& options) {
  return StiffnessLoader(file, options).LoadFile();
}

StiffnessScenarioResult LoadStiffnessScenarioText(const std::string& text, const std::string& file,
                                                  const ScenarioOptions& options) {
  return StiffnessLoader(file, options).Load(text);
}

}  // namespace mbv
