// `drives`, `drive_order` and `prescribed` of a model file. Internal to the model loader.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_joints.h"
#include "model_file/model_names.h"
#include "model_file/model_signals.h"
#include "model_file/model_values.h"

namespace mbv::internal {

/// Reads drives on known joints and between frames of known bodies.
class DriveReader {
 public:
  DriveReader(ModelValues* values, const BodyNames& names, const ModelJoints& joints,
              SignalPlaces* places, std::vector<Drive>* drives)
      : values_(*values), names_(names), joints_(joints), places_(*places), drives_(*drives) {}

  void Read(const Block& block);

 private:
  void ReadDrive(const Block& block, const YamlEntry& entry);
  bool ReadDistanceDrive(const Block& block, const YamlMap& map, Drive* drive);
  void ReadRange(const Block& block, const YamlMap& map, Drive* drive);
  double ReadStiffness(const Block& block, const YamlMap& map);

  ModelValues& values_;
  const BodyNames& names_;
  const ModelJoints& joints_;
  SignalPlaces& places_;
  std::vector<Drive>& drives_;
};

/// Keys of a joint's name and of the number of its coordinate (0 when left out).
struct CoordinateKeys {
  std::string joint = "joint", coordinate = "coordinate";
};
/// A coordinate that can be driven. Empty after a finding.
std::optional<JointDrive> ReadJointCoordinate(const ModelJoints& joints, const Block& block,
                                              const YamlMap& map, const CoordinateKeys& keys,
                                              YamlReader* yaml);

/// Highest power of a coordinate in a polynomial: that of MuJoCo's couplings.
inline constexpr size_t kMostPowers = 4;
/// One number, or a list of coefficients of a coordinate's powers, the first one that of the first.
/// Empty after a finding.
std::optional<std::vector<double>> ReadCoefficients(ModelValues* values, const Block& block,
                                                    const YamlMap& map, const std::string& key);

/// A number in the unit of a coordinate, a length or an angle, under a key that may carry a unit; 0
/// where it is left out. Empty after a finding, in which `of` names the coordinate's owner.
std::optional<double> ReadInCoordinateUnit(ModelValues* values, const Block& block,
                                           const YamlMap& map, const std::string& key, bool length,
                                           const std::string& of);

/// Puts the drives into the order of `drive_order`, which lists every one once.
void OrderDrives(const YamlNode& root, YamlReader* yaml, std::vector<Drive>* drives);

/// Reads prescribed joints.
void ReadPrescribed(const Block& block, const ModelJoints& joints, YamlReader* yaml,
                    SignalPlaces* places, std::vector<Prescribed>* prescribed);

}  // namespace mbv::internal
