#include "features/stiffness/stiffness_scenario.h"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>

#include "base/demand.h"
#include "base/text.h"
#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "scenario/file_parts.h"
#include "scenario/find_model.h"
#include "scenario/section_readers.h"

namespace mbv {

std::vector<Vec6> DrawLoads(const RandomLoads& loads) {
  std::uint64_t state = loads.seed;
  const auto draw = [&state] {
    state = 6364136223846793005ULL * state + 1442695040888963407ULL;
    return static_cast<double>(state >> 11U) * 0x1p-53;
  };
  std::vector<Vec6> wrenches(static_cast<size_t>(loads.count));
  for (Vec6& wrench : wrenches) {
    for (int i = 3; i < 6; ++i) wrench[i] = loads.force_max * draw();
    for (int i = 0; i < 3; ++i) wrench[i] = loads.moment_max * draw();
  }
  return wrenches;
}

std::string TextOf(const RandomLoads& loads) {
  return fmt::format("{} random wrenches, seed {}: forces 0 … {:g} N, moments 0 … {:g} N m",
                     loads.count, loads.seed, loads.force_max, loads.moment_max);
}

namespace {

namespace fs = std::filesystem;

constexpr int kMostLoads = 10000;

std::optional<double> NotNegative(ValueReader* values, const YamlNode& node,
                                  const std::string& path) {
  const auto value = values->Number(node, path);
  if (!value || *value >= 0.0) return value;
  values->yaml().Error(node, fmt::format("{} = {} violates {} >= 0", path, *value, path));
  return {};
}

RandomLoads ReadRandom(ValueReader* values, const YamlNode& node) {
  YamlReader& yaml = values->yaml();
  RandomLoads random;
  YamlMap map(&yaml, &node, "loads.random", {"count", "seed", "force_max", "moment_max"});
  if (const YamlNode* count = map.Find("count")) {
    random.count = yaml.Integer(*count, "loads.random.count").value_or(random.count);
    if (random.count < 1 || random.count > kMostLoads) {
      yaml.Error(*count, fmt::format("loads.random.count = {} violates 1 <= count <= {}",
                                     random.count, kMostLoads));
      random.count = 1;
    }
  }
  if (const YamlNode* seed = map.Find("seed")) {
    const std::string text = yaml.Text(*seed, "loads.random.seed").value_or("");
    const char* end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), end, random.seed);
    if (parsed.ec != std::errc() || parsed.ptr != end) {
      yaml.Error(*seed, fmt::format("loads.random.seed = {}: a whole number from 0 to 2^64 - 1 is "
                                    "needed",
                                    Describe(*seed)));
    }
  }
  for (const auto& [key, value] :
       {std::pair{"force_max", &random.force_max}, std::pair{"moment_max", &random.moment_max}}) {
    const YamlNode* number = map.Find(key);
    if (number == nullptr) continue;
    *value = NotNegative(values, *number, map.PathOf(key)).value_or(*value);
  }
  if (random.force_max == 0.0 && random.moment_max == 0.0) {
    yaml.Error(node, "loads.random: force_max = moment_max = 0 is not a load");
  }
  return random;
}

Vec6 ReadWrench(ValueReader* values, const YamlNode& node, const std::string& path) {
  Vec6 wrench = Vec6::Zero();
  YamlMap map(&values->yaml(), &node, path, {"force", "moment"});
  if (const YamlNode* force = map.Find("force")) {
    wrench.tail<3>() = values->Vector(*force, path + ".force").value_or(Vec3::Zero());
  }
  if (const YamlNode* moment = map.Find("moment")) {
    wrench.head<3>() = values->Vector(*moment, path + ".moment").value_or(Vec3::Zero());
  }
  if (map.valid() && !values->yaml().has_errors() && wrench.isZero(0.0)) {
    values->yaml().Error(node, path + " is not a load", "give force and/or moment");
  }
  return wrench;
}

// The wrenches of `loads:` and where they come from.
std::vector<Vec6> ReadLoads(ValueReader* values, const YamlNode* node, std::string* text) {
  if (node == nullptr || node->is_null() || AsSwitch(*node) == false) return {};
  YamlReader& yaml = values->yaml();
  std::vector<Vec6> loads;
  if (node->is_sequence()) {
    for (size_t i = 0; i < node->items.size() && i < kMostLoads; ++i) {
      loads.push_back(ReadWrench(values, *node->items[i], fmt::format("loads[{}]", i)));
    }
    *text = fmt::format("{} listed wrench{}", loads.size(), loads.size() == 1 ? "" : "es");
    return loads;
  }
  YamlMap map(&yaml, node, "loads", {"random"});
  const YamlNode* random_node = map.Required("random");
  if (random_node == nullptr) return {};
  const RandomLoads random = ReadRandom(values, *random_node);
  *text = TextOf(random);
  return DrawLoads(random);
}

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
    ReadParameters(map.Find("parameters"));
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
    const auto found = FindElasticModel(*name, fs::path(file_).parent_path().string());
    if (const Finding* none = std::get_if<Finding>(&found)) {
      yaml_.Error(node, fmt::format("mechanism = '{}': {}", *name, none->message), none->hint);
      return;
    }
    scenario_.model_file = std::get<std::string>(found);
    LoadWith(scenario_.parameters);
    if (!mechanism_) return;
    NameTheCase();
    const auto rigid = CheckElastic(*mechanism_, scenario_.model_file);
    if (rigid) yaml_.Error(node, "mechanism: " + rigid->message);
  }

  void LoadWith(const Overrides& overrides) {
    LoadOptions options;
    options.overrides = overrides;
    options.override_places = scenario_.parameter_places;
    LoadModelWith(options);
  }

  void ReadSettings(const YamlMap& map) {
    scenario_.analytic = ReadAnalytic(&values_, map.Find("analytic"));
    if (!scenario_.analytic.as_printed.empty()) {
      yaml_.Error(*map.Find("analytic"), "analytic.as_printed: stiffness models have no errata",
                  "analytic: {model: as_printed} takes the whole of the paper's own model");
    }
    const YamlNode* reference = map.Find("reference");
    scenario_.reference = ReadReference(&values_, reference);
    if (reference != nullptr && reference->is_map() && reference->Find("csv") != nullptr) {
      yaml_.Error(*reference, "reference.csv: no table replaces the frame elements");
    }
    if (const YamlNode* simulation = map.Find("simulation")) ReadSimulation(*simulation);
    scenario_.loads = ReadLoads(&values_, map.Find("loads"), &scenario_.loads_text);
    scenario_.checks = ReadStiffnessChecks(&values_, map.Find("checks"));
    scenario_.expect = ReadExpectation(&values_, map.Find("expect"));
    if (const YamlNode* printed = map.Find("compare_printed")) {
      scenario_.compare_printed = yaml_.Flag(*printed, "compare_printed").value_or(false);
    }
  }

  void ReadSimulation(const YamlNode& node) {
    if (node.is_null()) return;
    SimulationSettings& settings = scenario_.simulation;
    if (const auto on = AsSwitch(node)) {
      settings.on = *on;
      return;
    }
    YamlMap map(&yaml_, &node, "simulation", {"parameters", "force_N", "moment_Nm", "mode"});
    if (const YamlNode* mode = map.Find("mode")) {
      yaml_.Warn(*mode, "simulation.mode has no meaning here: stiffness is static");
    }
    settings.parameters = ReadOverrides(&values_, map.Find("parameters"), "simulation.parameters");
    for (const auto& [key, load] :
         {std::pair{"force_N", &scenario_.force_N}, {"moment_Nm", &scenario_.moment_Nm}}) {
      const YamlNode* number = map.Find(key);
      if (number != nullptr) *load = values_.Positive(*number, map.PathOf(key)).value_or(*load);
    }
  }

  // Coordinates of the pose, and parameters of the model that belong to it.
  void ReadPose(const YamlNode& node) {
    if (node.is_scalar() && node.text == "home") return;
    auto places = PlacesOf(node, file_, options_.set);
    Overrides parameters;
    for (const YamlEntry& entry : yaml_.Entries(node, "pose")) {
      const auto number = values_.Number(*entry.value, JoinPath("pose", entry.key));
      const auto fault = PutIntoPose(*mechanism_, entry.key, number, &scenario_.pose, &parameters);
      if (fault) yaml_.Error(entry, "pose: " + fault->message, fault->hint);
      const std::string name = SplitUnit(entry.key).name;
      if (parameters.contains(name)) scenario_.parameter_places[name] = places[entry.key];
    }
    if (!parameters.empty()) {
      scenario_.parameters = Merge(scenario_.parameters, parameters);
      LoadWith(scenario_.parameters);
    }
    if (!mechanism_ || yaml_.has_errors() || scenario_.pose.empty()) return;
    const auto fault = CheckPose(*mechanism_, scenario_.pose);
    if (fault) yaml_.Error(node, fault->message, fault->hint);
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

// Poses and models of stiffness scenarios.

namespace {

namespace fs = std::filesystem;

constexpr const char* kElasticFile = "elastic.yaml";

bool IsPath(const std::string& name) {
  return name.find('/') != std::string::npos || name.ends_with(".yaml");
}

std::string ElasticBeside(const std::string& model_file) {
  std::error_code error;
  const fs::path file = fs::path(model_file).parent_path() / kElasticFile;
  return fs::is_regular_file(file, error) ? file.string() : "";
}

}  // namespace

std::variant<std::string, Finding> FindElasticModel(const std::string& name,
                                                    const std::string& start) {
  const auto model = FindModel(name, start);
  if (model && IsPath(name)) return *model;
  if (const std::string elastic = model ? ElasticBeside(*model) : ""; !elastic.empty()) {
    return Shown(elastic);
  }
  std::vector<std::string> elastic_models;
  for (const std::string& known : ModelNames(start)) {
    const auto file = FindModel(known, start);
    if (file && !ElasticBeside(*file).empty()) elastic_models.push_back(known);
  }
  return Finding{
      .message = model ? fmt::format("{} has no {} with its beams and servos", name, kElasticFile)
                       : "there is no such model",
      .hint =
          DidYouMean(name, elastic_models,
                     elastic_models.empty() ? "" : "elastic models: " + Joined(elastic_models))};
}

Motion PoseMotion(const Mechanism& mechanism, const PoseValues& pose) {
  const std::vector<NamedCoordinate> known = NamedCommandCoordinates(mechanism);
  Motion motion;
  for (const auto& [name, value] : pose) {
    const auto found = std::ranges::find(known, name, &NamedCoordinate::name);
    MBV_DEMAND(found != known.end(), name);
    motion.commands.push_back(
        {.name = name, .terms = {{found->coordinate, 1.0}}, .profile = Constant(value)});
  }
  return motion;
}

PoseValues HomePose(const Mechanism& mechanism) {
  PoseValues pose;
  for (size_t i = 0; i < mechanism.drives.size(); ++i) {
    const Coordinate drive{Coordinate::Kind::kDrive, static_cast<int>(i), 0};
    pose[mechanism.drives[i].name] = HomeValue(mechanism, drive);
  }
  for (size_t i = 0; i < mechanism.prescribed.size(); ++i) {
    const Coordinate joint{Coordinate::Kind::kPrescribed, static_cast<int>(i), 0};
    pose[mechanism.prescribed[i].name] = HomeValue(mechanism, joint);
  }
  return pose;
}

std::optional<Finding> PutIntoPose(const Mechanism& mechanism, const std::string& key,
                                   std::optional<double> number, PoseValues* pose,
                                   Overrides* parameters) {
  const auto [name, unit] = SplitUnit(key);
  std::vector<std::string> known = NamesOf(NamedCommandCoordinates(mechanism));
  const bool coordinate = Contains(known, name), parameter = mechanism.HasParameter(name);
  if (!coordinate && !parameter) {
    for (const Parameter& p : mechanism.parameters) known.push_back(p.name);
    return Finding{
        .message = fmt::format("{} has no coordinate or parameter '{}'", mechanism.name, name),
        .hint = DidYouMean(name, known,
                           "known: drives, OUTPUT.x … OUTPUT.yaw, and the model's parameters")};
  }
  if (pose->contains(name) || parameters->contains(name)) {
    return Finding{.message = name + " is given twice"};
  }
  if (number && coordinate) (*pose)[name] = unit.to_si(*number);
  if (number && parameter) (*parameters)[name] = unit.to_si(*number);
  return {};
}

std::optional<Finding> CheckElastic(const Mechanism& mechanism, const std::string& model_file) {
  const bool servos = std::ranges::any_of(
      mechanism.drives, [](const Drive& drive) { return std::isfinite(drive.stiffness); });
  if (servos || !mechanism.beams.empty()) return {};
  return Finding{.message =
                     model_file + " is rigid: it has no beams and no drive with a stiffness"};
}

std::optional<Finding> CheckPose(const Mechanism& mechanism, const PoseValues& pose) {
  const std::vector<std::string> names = NamesOf(NamedCommandCoordinates(mechanism));
  for (const auto& [name, value] : pose) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    return Finding{.message = fmt::format("pose: {} has no coordinate '{}'", mechanism.name, name),
                   .hint = DidYouMean(
                       name, names, "known: drives, prescribed joints, and OUTPUT.x … OUTPUT.yaw")};
  }
  const int dofs = CountDofs(mechanism);
  if (static_cast<int>(pose.size()) == dofs) return {};
  return Finding{
      .message = fmt::format("pose gives {} coordinates, but {} has {} degrees of freedom",
                             pose.size(), mechanism.name, dofs),
      .hint =
          "give as many drives or output components (OUTPUT.x …) as there are degrees of freedom"};
}

}  // namespace mbv
