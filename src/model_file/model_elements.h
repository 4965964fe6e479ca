// `elements` of a model file. Internal to the model loader.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_joints.h"
#include "model_file/model_names.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// What elements act on, complete and in its final order.
struct ElementPlaces {
  const BodyNames& names;
  const ModelJoints& joints;
  const std::vector<Drive>& drives;
  const std::vector<Coupling>& couplings;
  std::vector<SpringDamper>& springs;  ///< of the model, and the lengths that elements add
};

/// Reads bushings, and force elements on coordinates of joints, along drives, springs or between
/// two points.
class ElementReader {
 public:
  ElementReader(ModelValues* values, const ElementPlaces& on, std::vector<Bushing>* bushings,
                std::vector<ForceElement>* elements)
      : values_(*values),
        names_(on.names),
        joints_(on.joints),
        drives_(on.drives),
        couplings_(on.couplings),
        springs_(on.springs),
        bushings_(*bushings),
        elements_(*elements) {}

  void Read(const Block& block);

 private:
  void ReadElement(const Block& block, const YamlEntry& entry);
  bool ReadPlace(const Block& block, const YamlMap& map, ForceElement* element);
  bool ReadDrive(const Block& block, const YamlMap& map, ForceElement* element);
  bool ReadSpringPlace(const Block& block, const YamlMap& map, ForceElement* element);
  bool TakeRotation(const Block& block, const YamlMap& map, ForceElement* element);
  bool SuitsBall(const YamlMap& map, const YamlNode& kind);
  bool ReadLaw(const Block& block, const YamlMap& map, const std::string& kind,
               ForceElement* element);
  std::optional<DampingLaw> ReadDamping(const Block& block, const YamlMap& map,
                                        const ForceElement* element);
  std::optional<SpringLaw> ReadSpring(const Block& block, const YamlMap& map,
                                      const ForceElement* element);
  std::optional<StopLaw> ReadStop(const Block& block, const YamlMap& map,
                                  const ForceElement* element);
  std::optional<CurveLaw> ReadCurve(const Block& block, const YamlMap& map,
                                    const ForceElement* element);
  std::optional<StopLaw> ReadRigid(const Block& block, const YamlMap& map, StopLaw stop, bool good);
  std::optional<CurvesLaw> ReadCurves(const Block& block, const YamlMap& map,
                                      const ForceElement* element);
  std::optional<ExpressionLaw> ReadExpression(const Block& block, const YamlMap& map);
  /// `of_curves`: which of several curves, or -1.
  bool ReadSlopes(const Block& block, const YamlMap& map, CurveLaw* curve, int of_curves = -1);
  std::optional<double> Slope(const Block& block, const YamlMap& map, const std::string& key,
                              const ForceElement* element);
  [[nodiscard]] bool IsAlongLength(const ForceElement& element) const;
  [[nodiscard]] std::string NameOf(const ForceElement& element) const;
  std::optional<RotorLaw> ReadRotor(const Block& block, const YamlMap& map,
                                    const ForceElement* element);
  bool ReadCarrier(const Block& block, const YamlMap& map, const ForceElement* element,
                   RotorLaw* rotor);
  bool ReadJointAsCarrier(const YamlNode& node, const std::string& path,
                          const ForceElement& element, RotorLaw* rotor);
  void ReadBushing(const Block& block, const YamlMap& map, const std::string& name);
  std::optional<Bushing> ReadBushingFrames(const Block& block, const YamlMap& map);
  std::optional<Vec6> ReadSix(const Block& block, const YamlMap& map, const std::string& key);
  std::optional<FrictionLaw> ReadFriction(const Block& block, const YamlMap& map,
                                          const ForceElement* element);
  std::optional<FrictionLaw> ReadDry(const Block& block, const YamlMap& map, bool loaded);
  bool ReadBearings(const Block& block, const YamlMap& map, const ForceElement& element,
                    FrictionLaw* law);
  bool ReadGearLoss(const Block& block, const YamlMap& map, const ForceElement& element,
                    FrictionLaw* law);
  bool ReadResists(const YamlMap& map, bool loaded, FrictionLaw* law);
  std::optional<std::vector<double>> ReadPolynomial(const Block& block, const YamlMap& map,
                                                    const ForceElement* element);
  std::optional<double> NotNegative(const Block& block, const YamlMap& map, const std::string& key,
                                    std::initializer_list<UnitSuffix> units = {kPlain});

  ModelValues& values_;
  const BodyNames& names_;
  const ModelJoints& joints_;
  const std::vector<Drive>& drives_;
  const std::vector<Coupling>& couplings_;
  std::vector<SpringDamper>& springs_;
  std::vector<Bushing>& bushings_;
  std::vector<ForceElement>& elements_;
};

}  // namespace mbv::internal
