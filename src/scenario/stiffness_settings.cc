#include "scenario/stiffness_settings.h"

#include <fmt/format.h>

#include <charconv>

#include "scenario/checks.h"
#include "scenario/file_parts.h"

namespace mbv {
namespace {

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
    yaml.Error(node, "loads.random: force_max = moment_max = 0 is no load");
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
    values->yaml().Error(node, path + " is no load", "give force and/or moment");
  }
  return wrench;
}

void ReadCheck(ValueReader* values, const YamlEntry& entry, StiffnessLimits* limits) {
  const bool reference = entry.key.starts_with(kReferencePrefix);
  const StiffnessMetricRow* row =
      FindStiffnessMetric(reference ? entry.key.substr(kReferencePrefix.size()) : entry.key);
  if (row == nullptr) return;  // reported as unknown key
  std::optional<double> limit;
  if (!entry.value->is_null() && AsSwitch(*entry.value) != false) {
    limit = values->Positive(*entry.value, "checks." + entry.key);
    if (!limit) return;
  }
  StiffnessLimit& target = (*limits)[row->metric];
  (reference ? target.computed : target.simulated) = limit;
}

}  // namespace

ReferenceSettings ReadStiffnessReference(ValueReader* values, const YamlNode* node) {
  ReferenceSettings settings;
  if (node == nullptr || node->is_null()) return settings;
  if (const auto on = AsSwitch(*node)) {
    settings.on = *on;
    return settings;
  }
  YamlMap map(&values->yaml(), node, "reference", {"parameters"});
  settings.parameters = ReadOverrides(values, map.Find("parameters"), "reference.parameters");
  return settings;
}

StiffnessSimulation ReadStiffnessSimulation(ValueReader* values, const YamlNode* node) {
  StiffnessSimulation settings;
  if (node == nullptr || node->is_null()) return settings;
  if (const auto on = AsSwitch(*node)) {
    settings.on = *on;
    return settings;
  }
  YamlMap map(&values->yaml(), node, "simulation", {"parameters", "force_N", "moment_Nm", "mode"});
  if (const YamlNode* mode = map.Find("mode")) {
    values->yaml().Warn(*mode, "simulation.mode has no meaning here: stiffness is static");
  }
  settings.parameters = ReadOverrides(values, map.Find("parameters"), "simulation.parameters");
  if (const YamlNode* force = map.Find("force_N")) {
    settings.force_N = values->Positive(*force, "simulation.force_N").value_or(settings.force_N);
  }
  if (const YamlNode* moment = map.Find("moment_Nm")) {
    settings.moment_Nm =
        values->Positive(*moment, "simulation.moment_Nm").value_or(settings.moment_Nm);
  }
  return settings;
}

std::vector<Vec6> ReadStiffnessLoads(ValueReader* values, const YamlNode* node, std::string* text) {
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
  *text = fmt::format("{} random wrenches, seed {}: forces 0 … {:g} N, moments 0 … {:g} N m",
                      random.count, random.seed, random.force_max, random.moment_max);
  return DrawLoads(random);
}

StiffnessLimits ReadStiffnessChecks(ValueReader* values, const YamlNode* node) {
  StiffnessLimits limits;
  std::vector<std::string> keys;
  for (const StiffnessMetricRow& row : StiffnessMetricRows()) {
    keys.emplace_back(row.key);
    keys.push_back(std::string(kReferencePrefix) + row.key);
  }
  YamlMap map(&values->yaml(), node, "checks", keys);
  if (!map.valid() || node == nullptr) return limits;
  for (const YamlEntry& entry : node->entries) ReadCheck(values, entry, &limits);
  return limits;
}

}  // namespace mbv
