// MJCF files as mechanisms, by MuJoCo's own compiler: defaults, classes, includes and inertias from
// geoms are resolved there.
//
// Read are hinges, slides, balls and bodies with several of them, `connect` and `weld` equalities
// as closures, `joint` and linear `tendon` equalities as couplings, actuators on joints as drives,
// sites as frames, boxes, spheres, capsules, cylinders and meshes of files as shapes, the first
// keyframe as the pose to close the loops from (mjcf_import.h). Free bodies are held. What the
// mechanism cannot express (armature, damping, springs and friction of joints, tendons, gears) is a
// finding each.
#pragma once

#include <optional>
#include <string>

#include "core/diagnostics.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// A description without home pose; Joint::home holds the pose of the file. Meshes name their
/// files; their surfaces are empty. Empty after errors. MuJoCo's parser may crash on hostile files:
/// call it in a process of its own.
[[nodiscard]] std::optional<Mechanism> ReadMjcf(const std::string& text, const std::string& file,
                                                Diagnostics* diagnostics);

}  // namespace mbv
