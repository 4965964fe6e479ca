// `couplings` of a model file. Internal to the model loader.
#pragma once

#include <optional>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_joints.h"
#include "model_file/model_names.h"
#include "model_file/model_signals.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// Reads couplings of coordinates of known joints: one that follows another (gears, belts, screws,
/// cams), or a weighted sum (differentials).
class CouplingReader {
 public:
  CouplingReader(ModelValues* values, const ModelJoints& joints, SignalPlaces* places,
                 std::vector<Coupling>* couplings)
      : values_(*values), joints_(joints), places_(*places), couplings_(*couplings) {}

  void Read(const Block& block);
  /// Those that helical joints are made of.
  void TakeScrews();

 private:
  void ReadCoupling(const Block& block, const YamlEntry& entry);
  bool ReadFollower(const Block& block, const YamlMap& map, Coupling* coupling);
  bool ReadSum(const Block& block, const YamlMap& map, Coupling* coupling);
  std::optional<Coupling::Term> Coordinate(const Block& block, const YamlMap& map,
                                           const std::string& key);
  std::optional<double> Offset(const Block& block, const YamlMap& map, const Coupling::Term& of);
  bool IsNew(const Coupling& coupling, const Coupling::Term& term, const YamlNode& at,
             const YamlMap& map);

  ModelValues& values_;
  const ModelJoints& joints_;
  SignalPlaces& places_;
  std::vector<Coupling>& couplings_;
};

}  // namespace mbv::internal
