// The file beside a URDF tree that names its closed loops. Internal to the model loader.
#pragma once

#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "input/yaml_reader.h"
#include "model_file/urdf.h"

namespace mbv::internal {

/// Takes the closures out of a tree that the URDF file itself states.
void DropClosures(UrdfTree* tree);

/// Reads the closure file that `node` names: closures and kinds of joints into the tree, motors by
/// name. False after a finding, which goes to `yaml` (the model file) or `others` (this file).
bool ReadClosureFile(const YamlNode& node, YamlReader* yaml, Diagnostics* others, UrdfTree* tree,
                     std::vector<std::string>* motors);

}  // namespace mbv::internal
