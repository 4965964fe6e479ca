// `drives`, `drive_order` and `prescribed` of a model file. Internal to the model loader.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "model_file/model_joints.h"
#include "model_file/model_names.h"
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
  void ReadCompensation(const YamlMap& map, Drive* drive);

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
/// `symbols:` of the model: what figures call drives.
void ReadSymbols(const YamlNode& root, YamlReader* yaml, std::vector<Drive>* drives);

/// Reads prescribed joints.
void ReadPrescribed(const Block& block, const ModelJoints& joints, YamlReader* yaml,
                    SignalPlaces* places, std::vector<Prescribed>* prescribed);

// `legs` of a model file: telescopic legs with two heavy halves, written in one line. Internal to
// the model loader.
//
//   legs: {leg1: {from: world.B1, to: platform.A1, length: 0.5, lower: {…}, upper: {…}}}
// stands for an instance of this part, with the z axis along the leg:
//   bodies: {lower: {mass, com: [0, 0, com], inertia: [across, across, along]}, upper: {…, −com}}
//   joints:
//     from:  {kind: universal, parent: FROM, child: lower, axis: y, axis2: x}
//     slide: {kind: prismatic, parent: lower, child: upper, axis: z, guess: LENGTH}
//     to:    {kind: spherical, parent: upper, child: TO}
//   (`ends` says which end is universal; both may be spherical)
//   drives: {length: {kind: joint, joint: slide}}

/// Adds a block for each leg of the blocks that there are; findings go to the reader.
void ExpandLegs(ModelValues* values, ModelBlocks* blocks);

// `motors` and `dc_link` of a model file. Internal to the model loader.

/// Reads the motors of known drives (mechanism/mechanism.h). Only a model has them, parts do not:
/// they are named as the drives of the whole model.
void ReadMotors(const Block& model, const std::vector<Drive>& drives,
                const std::vector<Joint>& joints, ModelValues* values, std::vector<Motor>* motors);

/// Empty where there is none, and after a finding.
[[nodiscard]] std::optional<DcLink> ReadDcLink(const Block& model, ModelValues* values);
[[nodiscard]] std::string DcLinkText(const DcLink& link);

}  // namespace mbv::internal
