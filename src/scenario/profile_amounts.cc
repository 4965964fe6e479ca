#include "scenario/profile_amounts.h"

#include <fmt/format.h>

namespace mbv {

YamlMap AmountReader::Map(const YamlNode* node, const std::string& path, const std::string& amount,
                          std::vector<std::string> keys) {
  for (std::string& key : InEveryUnit(amount)) keys.push_back(std::move(key));
  return {&values_->yaml(), node, path, keys};
}

YamlMap::InUnit AmountReader::FindAmount(const YamlMap& map, const std::string& key) {
  const YamlMap::InUnit found = map.FindInUnit(key, {kPlain, kDeg, kMm});
  if (found.node == nullptr || found.unit.Suits(context_.unit)) return found;
  values_->yaml().Error(
      *found.node,
      fmt::format("{} is given, but this value is in {}", map.PathOf(found.key), context_.unit),
      fmt::format("write {}", map.PathOf(key)));
  return {};
}

std::optional<double> AmountReader::Amount(const YamlMap& map, const std::string& key) {
  const YamlMap::InUnit found = FindAmount(map, key);
  if (found.node == nullptr) return {};
  const auto number = values_->Number(*found.node, map.PathOf(found.key));
  if (!number) return {};
  return found.unit.to_si(*number);
}

std::optional<std::vector<double>> AmountReader::Amounts(const YamlMap& map,
                                                         const std::string& key) {
  if (map.FindInUnit(key, {kPlain, kDeg, kMm}).node == nullptr) {
    (void)map.Required(key);  // reports it
    return {};
  }
  const YamlMap::InUnit found = FindAmount(map, key);
  if (found.node == nullptr) return {};
  auto numbers = values_->Numbers(*found.node, map.PathOf(found.key));
  if (!numbers) return {};
  for (double& number : *numbers) number = found.unit.to_si(number);
  return numbers;
}

std::optional<double> AmountReader::PositiveAmount(const YamlMap& map, const std::string& key) {
  const auto amount = RequiredAmount(map, key);
  if (!amount || *amount > 0.0) return amount;
  const YamlMap::InUnit found = map.FindInUnit(key, {kPlain, kDeg, kMm});
  values_->yaml().Error(*found.node, fmt::format("{0} = {1} violates {0} > 0",
                                                 map.PathOf(found.key), found.node->text));
  return {};
}

std::optional<double> AmountReader::RequiredAmount(const YamlMap& map, const std::string& key) {
  if (!map.valid()) return {};
  if (map.FindInUnit(key, {kPlain, kDeg, kMm}).node == nullptr) {
    (void)map.Required(key);  // reports it
    return {};
  }
  return Amount(map, key);
}

}  // namespace mbv
