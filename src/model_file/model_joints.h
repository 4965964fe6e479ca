// `joints` of a model file. Internal to the model loader.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "mechanism/spanning_tree.h"
#include "model_file/model_names.h"
#include "model_file/model_values.h"

namespace mbv::internal {

struct ModelJoints {
  std::vector<Joint> joints;
  std::vector<Place> places;      ///< per joint; those of a URDF file have none
  ClosureHints hints;             ///< per joint
  std::set<int> guessed;          ///< with a stated guess
  std::vector<Coupling> screws;   ///< travel by turn, of helical joints
  std::set<std::string> refused;  ///< names of joints that have a finding
  bool good = true;               ///< false: the graph of joints is not worth checking

  [[nodiscard]] int Find(const std::string& name) const { return IndexOf(joints, name); }
  void Add(Joint joint, Place place, std::optional<bool> hint);
};

/// Reads joints between frames of known bodies.
class JointReader {
 public:
  JointReader(ModelValues* values, const BodyNames& names, const ModelBodies& bodies,
              ModelJoints* joints)
      : values_(*values), names_(names), bodies_(bodies), joints_(*joints) {}

  void Read(const Block& block);

 private:
  // Empty after a finding.
  struct JointRead {
    Joint joint;
    std::optional<double> lead;  // of a helical joint [m per turn]
    std::optional<bool> hint;
    bool guessed = false;
  };
  std::optional<JointRead> ReadJoint(const Block& block, const YamlEntry& entry);
  void AddJoint(JointRead read, Place place);
  [[nodiscard]] bool IsFresh(const YamlEntry& entry, const std::string& path,
                             const std::string& name);
  bool ReadCoordinates(const Block& block, const YamlMap& map, std::optional<double> lead,
                       Joint* joint);
  bool ReadAxes(const Block& block, const YamlMap& map, Joint* joint);
  void ReadRange(const Block& block, const YamlMap& map, Joint* joint);
  void ReadRotationRange(const Block& block, const YamlNode& node, const std::string& path,
                         const UnitSuffix& unit, Joint* joint);
  bool ReadFreeChoices(const YamlMap& map, Joint* joint);
  std::optional<double> ReadLead(const Block& block, const YamlMap& map, bool helical);

  ModelValues& values_;
  const BodyNames& names_;
  const ModelBodies& bodies_;
  ModelJoints& joints_;
};

/// The choice that a `kind` makes; what is also looked for there, and models cannot express, is a
/// finding that says so.
[[nodiscard]] std::optional<int> ReadKind(const YamlNode& kind, const std::string& path,
                                          const std::vector<std::string>& words, YamlReader* yaml);

/// Reads the coordinates from which home is searched: a number, or one per DOF.
void ReadGuess(const Block& block, const YamlNode& node, const std::string& path,
               const UnitSuffix& unit, ModelValues* values, Joint* joint);

// `couplings` of a model file. Internal to the model loader.

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
