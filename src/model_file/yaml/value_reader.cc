#include "model_file/yaml/value_reader.h"

#include <fmt/format.h>

namespace mbv {

std::optional<double> ValueReader::Number(const YamlNode& node, const std::string& path) {
  if (!node.is_scalar()) {
    yaml_->Error(node, fmt::format("{} is {}, a number is needed", path, Describe(node)));
    return {};
  }
  const ExpressionResult result = scope_->Evaluate(node.text);
  if (!result.value) {
    yaml_->Error(node, fmt::format("{} = {} {}", path, Describe(node), result.error), result.hint);
  }
  return result.value;
}

std::shared_ptr<const Formula> ValueReader::Compile(const YamlNode& node, const std::string& path,
                                                    const std::string& expression,
                                                    const std::vector<std::string>& variables) {
  const FormulaResult result = scope_->Compile(expression, variables);
  if (result.formula == nullptr) {
    yaml_->Error(node, fmt::format("{} = {} {}", path, Describe(node), result.error), result.hint);
  }
  return result.formula;
}

std::optional<double> ValueReader::Positive(const YamlNode& node, const std::string& path) {
  const auto value = Number(node, path);
  if (value && *value <= 0.0) {
    yaml_->Error(node, fmt::format("{} = {} violates {} > 0", path, *value, path));
    return {};
  }
  return value;
}

std::optional<std::vector<double>> ValueReader::Numbers(const YamlNode& node,
                                                        const std::string& path, int count) {
  const auto items = yaml_->Items(node, path, count);
  if (!items) return {};
  std::vector<double> numbers;
  for (size_t i = 0; i < items->size(); ++i) {
    const auto number = Number(*(*items)[i], fmt::format("{}[{}]", path, i));
    if (number) numbers.push_back(*number);
  }
  if (numbers.size() != items->size()) return {};
  return numbers;
}

std::optional<Vec3> ValueReader::Vector(const YamlNode& node, const std::string& path) {
  const auto numbers = Numbers(node, path, 3);
  if (!numbers) return {};
  return Vec3((*numbers)[0], (*numbers)[1], (*numbers)[2]);
}

std::optional<double> ValueReader::InUnit(const YamlMap& map, const std::string& key,
                                          std::initializer_list<UnitSuffix> units) {
  const YamlMap::InUnit found = map.FindInUnit(key, units);
  if (found.node == nullptr) return {};
  const auto number = Number(*found.node, map.PathOf(found.key));
  if (!number) return {};
  return found.unit.to_si(*number);
}

std::optional<double> ValueReader::RequiredPositive(const YamlMap& map, const std::string& key) {
  const YamlNode* node = map.Required(key);
  if (node == nullptr) return {};
  return Positive(*node, map.PathOf(key));
}

Overrides ReadOverrides(ValueReader* values, const YamlNode* node, const std::string& path) {
  Overrides overrides;
  if (node == nullptr) return overrides;
  for (const YamlEntry& entry : values->yaml().Entries(*node, path)) {
    const auto number = values->Number(*entry.value, JoinPath(path, entry.key));
    if (number) overrides[entry.key] = *number;
  }
  return overrides;
}

}  // namespace mbv
