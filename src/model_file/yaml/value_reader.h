// Values of a scenario file: numbers may be expressions of the model's parameters.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/types.h"
#include "model_file/yaml/expressions.h"
#include "model_file/yaml/yaml_reader.h"

// Parameters of a model that a user sets.

namespace mbv {

/// Model parameters by name.
using Overrides = std::map<std::string, double>;

/// Reads numbers with a scope of parameters. Every reader reports a finding and returns nothing
/// when the value does not fit.
class ValueReader {
 public:
  ValueReader(YamlReader* yaml, Scope* scope) : yaml_(yaml), scope_(scope) {}

  std::optional<double> Number(const YamlNode& node, const std::string& path);
  /// With a rule: "simulation.step_s = 0 violates > 0".
  std::optional<double> Positive(const YamlNode& node, const std::string& path);
  std::optional<std::vector<double>> Numbers(const YamlNode& node, const std::string& path,
                                             int count = -1);
  std::optional<Vec3> Vector(const YamlNode& node, const std::string& path);

  /// An expression of parameters and of these variables.
  std::shared_ptr<const Formula> Compile(const YamlNode& node, const std::string& path,
                                         const std::string& expression,
                                         const std::vector<std::string>& variables);
  [[nodiscard]] bool HasParameter(const std::string& name) const { return scope_->Has(name); }

  /// A number under `key` in one of several units, in SI; `otherwise` if left out.
  std::optional<double> InUnit(const YamlMap& map, const std::string& key,
                               std::initializer_list<UnitSuffix> units);
  /// Required positive number of a map.
  std::optional<double> RequiredPositive(const YamlMap& map, const std::string& key);

  [[nodiscard]] YamlReader& yaml() { return *yaml_; }

 private:
  YamlReader* yaml_;
  Scope* scope_;
};

/// Parameters by name, as given in `parameters:` (numbers or expressions of numbers).
[[nodiscard]] Overrides ReadOverrides(ValueReader* values, const YamlNode* node,
                                      const std::string& path);

}  // namespace mbv
