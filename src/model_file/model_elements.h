// `elements` of a model file. Internal to the model loader.
#pragma once

#include <optional>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_joints.h"
#include "model_file/model_names.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// Reads force elements on coordinates of known joints or along known drives, which are in their
/// final order.
class ElementReader {
 public:
  ElementReader(ModelValues* values, const ModelJoints& joints, const std::vector<Drive>& drives,
                std::vector<ForceElement>* elements)
      : values_(*values), joints_(joints), drives_(drives), elements_(*elements) {}

  void Read(const Block& block);

 private:
  void ReadElement(const Block& block, const YamlEntry& entry);
  bool ReadPlace(const Block& block, const YamlMap& map, ForceElement* element);
  bool ReadDrive(const Block& block, const YamlMap& map, ForceElement* element);
  bool ReadLaw(const Block& block, const YamlMap& map, const std::string& kind,
               ForceElement* element);
  std::optional<DampingLaw> ReadDamping(const Block& block, const YamlMap& map);
  std::optional<SpringLaw> ReadSpring(const Block& block, const YamlMap& map,
                                      const ForceElement* element);
  std::optional<RotorLaw> ReadRotor(const Block& block, const YamlMap& map);
  std::optional<FrictionLaw> ReadFriction(const Block& block, const YamlMap& map,
                                          const ForceElement* element);
  std::optional<FrictionLaw> ReadDry(const Block& block, const YamlMap& map, bool loaded);
  std::optional<double> ReadJournal(const Block& block, const YamlMap& map,
                                    const ForceElement* element);
  bool FitsLoad(const YamlMap& map, const ForceElement& element);
  std::optional<std::vector<double>> ReadPolynomial(const Block& block, const YamlMap& map);
  std::optional<double> NotNegative(const Block& block, const YamlMap& map, const std::string& key);

  ModelValues& values_;
  const ModelJoints& joints_;
  const std::vector<Drive>& drives_;
  std::vector<ForceElement>& elements_;
};

}  // namespace mbv::internal
