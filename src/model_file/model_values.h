// Numbers, vectors, axes and poses of a model file. Internal to the model loader.
#pragma once

#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/types.h"
#include "input/units.h"
#include "input/yaml_reader.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "model_file/model_block.h"

namespace mbv::internal {

/// The numbers that a file writes out, in the order of reading.
class Literals {
 public:
  /// `replaced`: other values by place (LoadOptions::literals).
  explicit Literals(const std::map<std::string, double>& replaced) : replaced_(replaced) {}

  /// Takes note of a number; what it is replaced by, or itself.
  double At(const std::string& place, double value);
  [[nodiscard]] std::vector<Literal> Take() { return std::move(literals_); }

 private:
  const std::map<std::string, double>& replaced_;
  std::vector<Literal> literals_;
  std::set<std::string> places_;
};

/// Reads one value each, in the scope of a block; empty after a finding. Keys may carry a unit.
class ModelValues {
 public:
  ModelValues(YamlReader* yaml, Literals* literals) : yaml_(*yaml), literals_(*literals) {}

  std::optional<double> Number(const Block& block, const YamlNode& node, const std::string& path,
                               const UnitSuffix& unit = kPlain);
  std::optional<Vec3> Vector(const Block& block, const YamlNode& node, const std::string& path,
                             const UnitSuffix& unit = kPlain);
  /// The same under a key; empty without a finding when it is left out.
  std::optional<double> Number(const Block& block, const YamlMap& map, const std::string& key,
                               std::initializer_list<UnitSuffix> units);
  std::optional<Vec3> Vector(const Block& block, const YamlMap& map, const std::string& key,
                             std::initializer_list<UnitSuffix> units);
  /// A required number > 0.
  std::optional<double> Positive(const Block& block, const YamlMap& map, const std::string& key,
                                 std::initializer_list<UnitSuffix> units);
  /// The required key `radius` > 0 [m].
  std::optional<double> Radius(const Block& block, const YamlMap& map);
  /// "x", "-y", or a vector of any length; unit.
  std::optional<Vec3> Axis(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<Pose> PoseOf(const Block& block, const YamlNode& node, const std::string& path);
  /// [lower, upper], null for none.
  std::optional<CoordinateRange> Range(const Block& block, const YamlNode& node,
                                       const std::string& path, const UnitSuffix& unit);

  [[nodiscard]] YamlReader& yaml() { return yaml_; }

 private:
  std::optional<Mat3> Rotation(const Block& block, const YamlNode& node, const std::string& path);
  std::optional<Mat3> RotationMatrix(const Block& block, const YamlNode& node,
                                     const std::string& path);
  std::optional<Mat3> RotationFromAxes(const Block& block, const YamlNode& node,
                                       const std::string& path);

  YamlReader& yaml_;
  Literals& literals_;
};

}  // namespace mbv::internal
