#include "scenario/section_readers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "base/text.h"
#include "mechanism/reach.h"
#include "scenario/checks.h"
#include "scenario/file_parts.h"

namespace mbv {
namespace {

// A limit: positive number, or nothing/off; reported otherwise.
struct LimitValue {
  bool valid = false;
  std::optional<double> limit;
};
LimitValue ReadLimit(ValueReader* values, const YamlNode& node, const std::string& path) {
  if (node.is_null() || AsSwitch(node) == false) return {true, {}};
  const auto number = values->Positive(node, path);
  return {number.has_value(), number};
}

std::vector<std::string> CheckKeys(std::span<const MetricRow> rows) {
  std::vector<std::string> keys;
  for (const MetricRow& row : rows) {
    keys.emplace_back(row.key);
    if (row.metric == Metric::kMotorUse) continue;  // the same for all
    keys.push_back(std::string(kReferencePrefix) + row.key);
  }
  return keys;
}

void ReadCheck(ValueReader* values, const YamlEntry& entry, std::span<const MetricRow> rows,
               CheckLimits* limits) {
  const std::string path = "checks." + entry.key;
  const bool reference = entry.key.starts_with(kReferencePrefix);
  const MetricRow* row =
      FindMetric(reference ? entry.key.substr(kReferencePrefix.size()) : entry.key, rows);
  if (row == nullptr) return;  // reported as unknown key
  MetricLimits& target = (*limits)[row->metric];
  const bool has_modes = row->metric != Metric::kMotorUse && !IsOfStiffness(row->metric);
  if (entry.value->is_map() && !reference && has_modes) {
    YamlMap map(&values->yaml(), entry.value.get(), path, {"forward", "inverse", "servo"});
    for (const YamlEntry& mode : entry.value->entries) {
      const LimitValue value = ReadLimit(values, *mode.value, JoinPath(path, mode.key));
      if (!value.valid) continue;
      if (mode.key == "forward") target.forward = value.limit;
      if (mode.key == "inverse") target.inverse = value.limit;
      if (mode.key == "servo") target.servo = value.limit;
    }
    return;
  }
  const LimitValue value = ReadLimit(values, *entry.value, path);
  if (!value.valid) return;
  if (row->metric == Metric::kMotorUse) {
    // A margin of at least 1.2 is a use of at most 1/1.2, whoever computed it.
    const auto use = value.limit ? std::optional(1.0 / *value.limit) : std::nullopt;
    target = {.forward = use, .inverse = use, .reference = use, .servo = use};
  } else if (reference) {
    target.reference = value.limit;
  } else {
    target.forward = target.inverse = value.limit;
  }
}

}  // namespace

AnalyticSettings ReadAnalytic(ValueReader* values, const YamlNode* node) {
  AnalyticSettings settings;
  if (node == nullptr || node->is_null()) return settings;
  if (const auto on = AsSwitch(*node)) {
    settings.on = settings.stated = *on;
    return settings;
  }
  settings.stated = true;
  YamlReader& yaml = values->yaml();
  YamlMap map(&yaml, node, "analytic",
              {"model", "as_printed", "parameters", "required", "equations"});
  if (const YamlNode* flag = map.Find("required")) {
    settings.required = yaml.Flag(*flag, "analytic.required").value_or(false);
  }
  if (const YamlNode* model = map.Find("model")) {
    settings.model = yaml.Text(*model, "analytic.model").value_or("");
  }
  if (const YamlNode* printed = map.Find("as_printed")) {
    const auto items = yaml.Items(*printed, "analytic.as_printed");
    for (const YamlNode* item : items ? *items : std::vector<const YamlNode*>{}) {
      const auto text = yaml.Text(*item, "analytic.as_printed");
      if (text) settings.as_printed.push_back(*text);
    }
  }
  settings.parameters = ReadOverrides(values, map.Find("parameters"), "analytic.parameters");
  if (const YamlNode* file = map.Find("equations")) {
    settings.equations = yaml.Text(*file, "analytic.equations").value_or("");
    settings.equations_typed = file->line < 0;
    settings.equations_line = std::max(0, file->line);
    if (map.Has("model") || map.Has("as_printed")) {
      yaml.Error(*file, "analytic.equations: a file of equations has neither model nor as_printed",
                 "these choose among the formulations of a built-in closed form");
    }
  }
  return settings;
}

ReferenceSettings ReadReference(ValueReader* values, const YamlNode* node) {
  ReferenceSettings settings;
  if (node == nullptr || node->is_null()) return settings;
  if (const auto on = AsSwitch(*node)) {
    settings.on = *on;
    return settings;
  }
  if (node->is_map() && node->Find("csv") != nullptr) return settings;  // see table_settings.h
  YamlMap map(&values->yaml(), node, "reference", {"parameters"});
  settings.parameters = ReadOverrides(values, map.Find("parameters"), "reference.parameters");
  return settings;
}

namespace {

Extrapolation ReadExtrapolation(ValueReader* values, const YamlNode& node) {
  YamlReader& yaml = values->yaml();
  Extrapolation extrapolation;
  YamlMap map(&yaml, &node, "simulation.extrapolate", {"parameter", "from"});
  if (const YamlNode* parameter = map.Required("parameter")) {
    extrapolation.parameter =
        yaml.Text(*parameter, "simulation.extrapolate.parameter").value_or("");
  }
  if (const YamlNode* from = map.Find("from")) {
    const auto numbers = values->Numbers(*from, "simulation.extrapolate.from", 2);
    if (numbers) extrapolation.from = {(*numbers)[0], (*numbers)[1]};
    if (numbers && (*numbers)[0] == (*numbers)[1]) {
      yaml.Error(*from, "simulation.extrapolate.from: the two values are equal");
    }
  }
  return extrapolation;
}

// `kp: 2e5`, or `kp: {DRIVE: 2e5, …}`.
Gain ReadGain(ValueReader* values, const YamlNode& node, const std::string& path) {
  Gain gain;
  if (!node.is_map()) {
    gain.all = values->Positive(node, path);
    return gain;
  }
  for (const YamlEntry& entry : values->yaml().Entries(node, path)) {
    const auto number = values->Positive(*entry.value, JoinPath(path, entry.key));
    if (number) gain.by_drive[entry.key] = *number;
  }
  return gain;
}

// In the order of DriveMode.
const std::vector<std::string> kModes = {"forward", "inverse", "force_driven", "servo"};

// The mode and what belongs to it.
void ReadMode(ValueReader* values, YamlMap* map, SimulationSettings* settings) {
  YamlReader& yaml = values->yaml();
  if (const YamlNode* mode = map->Find("mode")) {
    const auto choice = yaml.Choice(*mode, "simulation.mode", kModes);
    if (choice) settings->mode = static_cast<DriveMode>(*choice);
  }
  if (settings->mode == DriveMode::kServo) {
    if (const YamlNode* kp = map->Required("kp")) {
      settings->servo.kp = ReadGain(values, *kp, "simulation.kp");
    }
    if (const YamlNode* kv = map->Required("kv")) {
      settings->servo.kv = ReadGain(values, *kv, "simulation.kv");
    }
    if (const YamlNode* node = map->Find("feedforward")) {
      settings->servo.feedforward =
          yaml.Choice(*node, "simulation.feedforward", {"none", "forces"}) == 1;
    }
    return;
  }
  for (const char* key : {"kp", "kv", "feedforward"}) {
    const YamlNode* node = map->Find(key);
    if (node == nullptr) continue;
    yaml.Warn(*node, fmt::format("simulation.{} is of no use without mode: servo", key));
  }
}

}  // namespace

SimulationSettings ReadSimulation(ValueReader* values, const YamlNode* node) {
  SimulationSettings settings;
  if (node == nullptr || node->is_null()) return settings;
  if (const auto on = AsSwitch(*node)) {
    settings.on = *on;
    return settings;
  }
  YamlReader& yaml = values->yaml();
  YamlMap map(&yaml, node, "simulation",
              {"mode", "step_s", "engine", "stock_too", "parameters", "extrapolate",
               "ignore_ranges", "kp", "kv", "feedforward"});
  ReadMode(values, &map, &settings);
  if (const YamlNode* engine = map.Find("engine")) {
    settings.stock_engine = yaml.Choice(*engine, "simulation.engine", {"corrected", "stock"}) == 1;
  }
  if (const YamlNode* step = map.Find("step_s")) {
    settings.step_s = values->Positive(*step, "simulation.step_s").value_or(settings.step_s);
  }
  if (const YamlNode* flag = map.Find("stock_too")) {
    settings.stock_too = yaml.Flag(*flag, "simulation.stock_too").value_or(settings.stock_too);
  }
  if (const YamlNode* flag = map.Find("ignore_ranges")) {
    settings.ignore_ranges = yaml.Flag(*flag, "simulation.ignore_ranges").value_or(false);
  }
  settings.parameters = ReadOverrides(values, map.Find("parameters"), "simulation.parameters");
  if (const YamlNode* extrapolate = map.Find("extrapolate")) {
    settings.extrapolate = ReadExtrapolation(values, *extrapolate);
  }
  return settings;
}

void CheckGain(const YamlNode& node, const std::string& path, const Gain& gain,
               const Mechanism& mechanism, YamlReader* yaml) {
  std::vector<std::string> names, missing;
  for (const Drive& drive : mechanism.drives) {
    names.push_back(drive.name);
    if (!gain.all && !gain.by_drive.contains(drive.name)) missing.push_back(drive.name);
  }
  if (!missing.empty()) {
    yaml->Error(node, fmt::format("{} gives nothing for {}", path, fmt::join(missing, ", ")));
  }
  for (const auto& [name, value] : gain.by_drive) {
    if (std::find(names.begin(), names.end(), name) != names.end()) continue;
    yaml->Error(node, fmt::format("{}: there is no drive '{}'", path, name),
                DidYouMean(name, names, fmt::format("drives: {}", fmt::join(names, ", "))));
  }
}

CheckLimits DefaultLimits(const Mechanism& mechanism) {
  CheckLimits limits;
  const double length_m = CharacteristicLength(mechanism);
  const double rounding_m = GapRounding(Reach(LongestLever(mechanism), mechanism.X_WB_home));
  for (const MetricRow& row : MetricRows()) {
    if (std::string_view(row.unit) != "m") continue;
    MetricLimits& of = limits[row.metric];
    for (std::optional<double>* limit : {&of.forward, &of.inverse, &of.reference}) {
      if (*limit) *limit = **limit * length_m + rounding_m;
    }
  }
  return limits;
}

CheckLimits ReadChecks(ValueReader* values, const YamlNode* node, const Mechanism* mechanism,
                       double* start_window_s) {
  CheckLimits limits = mechanism != nullptr ? DefaultLimits(*mechanism) : CheckLimits();
  std::vector<std::string> keys = CheckKeys(MetricRows());
  keys.insert(keys.begin(), "start_window_s");
  YamlMap map(&values->yaml(), node, "checks", keys);
  if (!map.valid() || node == nullptr) return limits;
  for (const YamlEntry& entry : node->entries) {
    if (entry.key == "start_window_s") {
      *start_window_s = values->Positive(*entry.value, "checks.start_window_s").value_or(0.0);
    } else {
      ReadCheck(values, entry, MetricRows(), &limits);
    }
  }
  return limits;
}

CheckLimits ReadStiffnessChecks(ValueReader* values, const YamlNode* node) {
  CheckLimits limits;
  YamlMap map(&values->yaml(), node, "checks", CheckKeys(StiffnessMetricRows()));
  if (!map.valid() || node == nullptr) return limits;
  for (const YamlEntry& entry : node->entries) {
    ReadCheck(values, entry, StiffnessMetricRows(), &limits);
  }
  return limits;
}

Expectation ReadExpectation(ValueReader* values, const YamlNode* node) {
  Expectation expect;
  YamlReader& yaml = values->yaml();
  YamlMap map(&yaml, node, "expect", {"verdict", "exit_code", "mentions"});
  const std::vector<std::string> words = {"agree", "disagree", "not_run"};
  if (const YamlNode* verdict = map.Find("verdict")) {
    const auto choice = yaml.Choice(*verdict, "expect.verdict", words);
    if (choice) expect.verdict = words[static_cast<size_t>(*choice)];
    expect.exit_code = choice == 1 ? 1 : choice == 2 ? 3 : 0;
  }
  if (const YamlNode* code = map.Find("exit_code")) {
    expect.exit_code = yaml.Integer(*code, "expect.exit_code").value_or(0);
    if (!map.Has("verdict")) {
      expect.verdict = expect.exit_code == 0   ? "agree"
                       : expect.exit_code == 1 ? "disagree"
                                               : "not_run";
    }
  }
  if (const YamlNode* mentions = map.Find("mentions")) {
    expect.mentions = yaml.Text(*mentions, "expect.mentions").value_or("");
  }
  return expect;
}

}  // namespace mbv
