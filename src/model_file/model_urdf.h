// The `urdf` key of a model file: FILE, or {file, closures, constraints, guess: {JOINT: …}}.
// Internal to the model loader.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"
#include "model_file/model_bodies.h"
#include "model_file/model_joints.h"
#include "model_file/model_values.h"
#include "model_file/urdf/urdf_import.h"
#include "model_file/yaml/yaml_reader.h"

namespace mbv::internal {

/// What a URDF file gives to a model in addition to bodies and joints.
struct UrdfSection {
  int root = -1;                          ///< body that needs a joint to the world; -1: none
  std::map<std::string, Finding> joints;  ///< where each joint is described, closures included
  std::vector<ModelCaveat> left_out;
  std::optional<Vec3> gravity_W;        ///< where the file states it
  std::map<std::string, Motor> motors;  ///< limits of what may move a joint, by its name
};

/// Reads the links of a URDF file as bodies, its joints and closures, its motors as drives,
/// its mimic joints as couplings and the damping of its joints as force elements.
class UrdfReader {
 public:
  /// `bare`: the model file stands for the URDF file, and was not written by a user.
  UrdfReader(bool bare, ModelValues* values, Literals* literals, Diagnostics* others)
      : bare_(bare), values_(*values), literals_(*literals), others_(*others) {}

  /// Where the results go: behind the world, and nothing else there yet.
  struct Into {
    ModelBodies* bodies;
    ModelJoints* joints;  ///< not good after a finding
    SignalPlaces* places;
    std::vector<Drive>* drives;
    std::vector<Coupling>* couplings;
    std::vector<ForceElement>* elements;
  };
  UrdfSection Read(const Block& model, const YamlNode& node, const Into& into);

  /// Fixes the root link, or of a bare URDF the link `base` where joints at their guesses have it,
  /// to the world, unless a joint of the model file carries the root.
  void HoldBase(int root, const FloatingBase& base, const ModelBodies& bodies, ModelJoints* joints);

 private:
  /// The tree as the file and the closure file have it, links that are frames folded.
  struct Source {
    std::string file;
    UrdfTree tree;
    std::vector<std::string> motors;
  };
  std::optional<Source> ReadSource(const Block& model, const YamlNode& name, const YamlMap& map);
  UrdfSection Add(const Source& source, ModelBodies* bodies, ModelJoints* joints);
  void TakeLiterals(Body* body);
  void ReadGuesses(const Block& model, const YamlMap& map, ModelJoints* joints);
  void ReadCompensation(const Block& model, const YamlMap& map, ModelBodies* bodies);
  std::vector<std::string> MotorsOf(const Source& source, const ModelJoints& joints) const;
  void AddMimics(const UrdfTree& tree, const YamlNode& at, const Into& into);
  void AddDynamics(const UrdfTree& tree, const Into& into);
  void AddExtras(const UrdfTree& tree, const Into& into);
  void AddDrives(const std::vector<std::string>& motors, const YamlNode& at, const Into& into);

  bool bare_;
  ModelValues& values_;
  Literals& literals_;
  Diagnostics& others_;
};

// The file beside a URDF tree that names its closed loops. Internal to the model loader.

/// Takes the closures out of a tree that the URDF file itself states.
void DropClosures(UrdfTree* tree);

/// Reads the closure file that `node` names: closures and kinds of joints into the tree, motors by
/// name. False after a finding, which goes to `yaml` (the model file) or `others` (this file).
bool ReadClosureFile(const YamlNode& node, YamlReader* yaml, Diagnostics* others, UrdfTree* tree,
                     std::vector<std::string>* motors);

}  // namespace mbv::internal
