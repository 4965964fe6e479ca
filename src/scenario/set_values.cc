#include "scenario/set_values.h"

#include <algorithm>
#include <charconv>

#include "input/value_reader.h"

namespace mbv {
namespace {

std::string OptionText(const SetValue& value) {
  return "--set " + value.first + "=" + value.second;
}

// A copy whose every node carries `line`.
YamlNodePtr Relocate(const YamlNode& node, int line) {
  auto copy = std::make_shared<YamlNode>(node);
  copy->line = line;
  copy->column = 0;
  for (YamlNodePtr& item : copy->items) item = Relocate(*item, line);
  for (YamlEntry& entry : copy->entries) {
    entry.line = line;
    entry.column = 0;
    entry.value = Relocate(*entry.value, line);
  }
  return copy;
}

// Length of the first key of `path` in `map`: the longest key that is there, else up to the first
// dot; names of commands ("platform.z") and of parts' parameters ("leg1.m") contain dots
// themselves.
size_t FirstKey(const YamlNode& map, const std::string& path, const std::string& parent) {
  size_t best = 0;
  for (const YamlEntry& entry : map.entries) {
    const size_t n = entry.key.size();
    if (n > best && path.starts_with(entry.key) && (path.size() == n || path[n] == '.')) best = n;
  }
  if (best > 0) return best;
  const bool dotted = parent == "commands" || parent == "pose" || parent == "parameters";
  return dotted ? path.size() : std::min(path.find('.'), path.size());
}

// The item of a list that a path begins with ("1.sine.amplitude"), and the path behind its number.
struct ListStep {
  size_t index = 0;
  std::string rest;
};
std::optional<ListStep> FirstItem(const YamlNode* list, const std::string& path) {
  if (list == nullptr || !list->is_sequence()) return {};
  ListStep step;
  const char* end = path.data() + path.size();
  const auto [at, error] = std::from_chars(path.data(), end, step.index);
  if (error != std::errc() || step.index >= list->items.size()) return {};
  if (at != end && *at != '.') return {};
  step.rest.assign(at == end ? at : at + 1, end);
  return step;
}

// A parameter of the model that was meant as such.
void HintAtParameters(const SetValue& value, Finding* finding) {
  const bool unknown = finding->message == "the file: unknown key '" + value.first + "'";
  if (!unknown || value.first.find('.') != std::string::npos) return;
  finding->hint = "a parameter of the model: --set parameters." + value.first + "=" + value.second +
                  "; " + finding->hint;
}

YamlNodePtr SetAt(const YamlNode* node, const std::string& parent, const std::string& path,
                  const YamlNodePtr& value) {
  if (path.empty()) return value;
  if (const auto step = FirstItem(node, path)) {
    auto list = std::make_shared<YamlNode>(*node);
    YamlNodePtr& item = list->items[step->index];
    item = SetAt(item.get(), "", step->rest, value);
    return list;
  }
  auto map = std::make_shared<YamlNode>();
  map->line = value->line;
  if (node != nullptr && node->is_map()) *map = *node;
  map->kind = YamlNode::Kind::kMap;
  const size_t length = FirstKey(*map, path, parent);
  const std::string key = path.substr(0, length);
  const std::string rest = length < path.size() ? path.substr(length + 1) : "";
  for (YamlEntry& entry : map->entries) {
    if (entry.key != key) continue;
    entry.value = SetAt(entry.value.get(), key, rest, value);
    return map;
  }
  map->entries.push_back({key, value->line, 0, SetAt(nullptr, key, rest, value)});
  return map;
}

}  // namespace

YamlNodePtr SetValues(YamlNodePtr root, const std::vector<SetValue>& values, YamlReader* reader) {
  for (size_t k = 0; k < values.size(); ++k) {
    const int line = -static_cast<int>(k) - 1;
    YamlReader value_reader(OptionText(values[k]));
    const YamlNodePtr value = value_reader.Parse(values[k].second);
    if (value == nullptr || values[k].first.empty()) {
      reader->AddAt(Severity::kError, line, 0, "the value is no YAML",
                    "write --set key=value, e.g. --set simulation.step_s=0.002");
      continue;
    }
    root = SetAt(root.get(), "", values[k].first, Relocate(*value, line));
  }
  return root;
}

const YamlNode* FindSetNode(const YamlNode& root, const std::string& key) {
  const YamlNode* node = &root;
  std::string parent, path = key;
  while (node != nullptr && !path.empty()) {
    if (const auto step = FirstItem(node, path)) {
      node = node->items[step->index].get();
      parent.clear();
      path = step->rest;
      continue;
    }
    if (!node->is_map()) break;
    const size_t length = FirstKey(*node, path, parent);
    parent = path.substr(0, length);
    path = length < path.size() ? path.substr(length + 1) : "";
    node = node->Find(parent);
  }
  return path.empty() ? node : nullptr;
}

Diagnostics ReadParameterOptions(const std::vector<SetValue>& values, LoadOptions* options) {
  Diagnostics diagnostics;
  for (const SetValue& value : values) {
    YamlReader yaml(OptionText(value));
    Scope scope;
    ValueReader reader(&yaml, &scope);
    const YamlNodePtr node = yaml.Parse(value.second);
    const auto number = node == nullptr ? std::nullopt : reader.Number(*node, value.first);
    if (number) options->overrides[value.first] = *number;
    options->override_places[value.first].file = OptionText(value);
    for (Finding finding : yaml.diagnostics().findings()) {
      finding.line = 0;  // there is only one
      if (finding.hint.empty()) finding.hint = "write --set PARAMETER=NUMBER, e.g. --set m_p=45000";
      diagnostics.Add(std::move(finding));
    }
  }
  return diagnostics;
}

Diagnostics PlaceSetFindings(const Diagnostics& diagnostics, const std::vector<SetValue>& values) {
  std::vector<Finding> findings;
  for (Finding finding : diagnostics.findings()) {
    if (finding.line < 0) {
      const SetValue& value = values[static_cast<size_t>(-finding.line - 1)];
      HintAtParameters(value, &finding);
      finding.file = OptionText(value);
      finding.line = 0;
    }
    findings.push_back(std::move(finding));
  }
  std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  Diagnostics placed;
  for (Finding& finding : findings) placed.Add(std::move(finding));
  return placed;
}

}  // namespace mbv
