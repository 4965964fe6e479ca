// Numbers of profiles in the unit of what they are for. Internal to the readers of profiles.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scenario/profile_reader.h"

namespace mbv {

class AmountReader {
 protected:
  AmountReader(ValueReader* values, const ProfileContext& context)
      : values_(values), context_(context) {}

  /// A term's map; `amount` is the key that may be given in several units.
  YamlMap Map(const YamlNode* node, const std::string& path, const std::string& amount,
              std::vector<std::string> keys);
  /// A length or angle, or its rates; the unit must suit the coordinate. Empty when left out.
  YamlMap::InUnit FindAmount(const YamlMap& map, const std::string& key);
  std::optional<double> Amount(const YamlMap& map, const std::string& key);
  /// A required list.
  std::optional<std::vector<double>> Amounts(const YamlMap& map, const std::string& key);
  std::optional<double> PositiveAmount(const YamlMap& map, const std::string& key);
  std::optional<double> RequiredAmount(const YamlMap& map, const std::string& key);

  ValueReader* values_;
  const ProfileContext& context_;
};

}  // namespace mbv
