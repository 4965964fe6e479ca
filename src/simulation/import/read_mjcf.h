// MJCF files as mechanisms, by MuJoCo's own compiler: defaults, classes, includes and inertias from
// geoms are resolved there.
//
// Read are hinges, slides, balls and bodies with several of them, `connect` and `weld` equalities
// as closures, `joint` and linear `tendon` equalities as couplings, actuators on joints as drives,
// sites as frames, boxes, spheres, capsules, cylinders and meshes of files as shapes, the first
// keyframe as the pose to close the loops from (mjcf_import.h). Of free bodies one is held, unless
// closures tie them to the world. What the mechanism cannot express is a finding each, and a caveat
// where forces depend on it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/markup.h"
#include "mechanism/mechanism.h"
#include "simulation/engine/engine.h"

// An MJCF file compiled, and where its parts are in the mechanism that was made of it. Internal to
// simulation/.

namespace mbv::simulation {

struct ImportedMjcf {
  Mechanism mechanism;  ///< as ReadMjcf() gives it
  ModelHandle model;
  std::vector<ModelCaveat> left_out;
  PrintedRounding printed;            ///< of the file, with what it includes
  std::string text;                   ///< as compiled: without what this compiler does not know
  std::vector<int> joint_of;          ///< per MuJoCo joint: index into mechanism.joints, or -1
  std::vector<int> closure_of;        ///< per equality: index into mechanism.joints, or -1
  std::vector<bool> closed_by_sites;  ///< per equality: by two sites, which MuJoCo 2.2 cannot
};

/// Empty after errors, which are findings. Needs an EngineSession, whose warnings it reads. `base`:
/// as of ReadMjcf().
[[nodiscard]] std::optional<ImportedMjcf> ImportMjcf(const std::string& text,
                                                     const std::string& file,
                                                     const FloatingBase& base,
                                                     const std::vector<std::string>& warnings,
                                                     Diagnostics* diagnostics);

}  // namespace mbv::simulation

namespace mbv {

struct MjcfModel {
  /// A description without home pose; Joint::home holds the pose of the file. Meshes name their
  /// files; their surfaces are empty.
  Mechanism mechanism;
  std::vector<ModelCaveat> left_out;
  PrintedRounding printed;
};

/// Empty after errors. Without a body to hold, the first of those that hang together is held.
/// MuJoCo's parser may crash on hostile files: call it in a process of its own.
[[nodiscard]] std::optional<MjcfModel> ReadMjcf(const std::string& text, const std::string& file,
                                                const FloatingBase& base, Diagnostics* diagnostics);

}  // namespace mbv
