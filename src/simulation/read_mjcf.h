// MJCF files as mechanisms, by MuJoCo's own compiler: defaults, classes, includes and inertias from
// geoms are resolved there.
//
// Read are hinges, slides, balls and bodies with several of them, `connect` and `weld` equalities
// as closures, `joint` and linear `tendon` equalities as couplings, actuators on joints as drives,
// sites as frames, boxes, spheres, capsules, cylinders and meshes of files as shapes, the first
// keyframe as the pose to close the loops from (mjcf_import.h). Free bodies are held. What the
// mechanism cannot express is a finding each, and a caveat where forces depend on it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "mechanism/mechanism.h"
#include "mechanism/model_caveat.h"

namespace mbv {

struct MjcfModel {
  /// A description without home pose; Joint::home holds the pose of the file. Meshes name their
  /// files; their surfaces are empty.
  Mechanism mechanism;
  std::vector<ModelCaveat> left_out;
};

/// Empty after errors. MuJoCo's parser may crash on hostile files: call it in a process of its own.
[[nodiscard]] std::optional<MjcfModel> ReadMjcf(const std::string& text, const std::string& file,
                                                Diagnostics* diagnostics);

}  // namespace mbv
