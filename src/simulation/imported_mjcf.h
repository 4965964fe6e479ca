// An MJCF file compiled, and where its parts are in the mechanism that was made of it. Internal to
// simulation/.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "mechanism/mechanism.h"
#include "mechanism/model_caveat.h"
#include "simulation/engine.h"

namespace mbv::simulation {

struct ImportedMjcf {
  Mechanism mechanism;  ///< as ReadMjcf() gives it
  ModelHandle model;
  std::vector<ModelCaveat> left_out;
  std::string text;                   ///< as compiled: without what this compiler does not know
  std::vector<int> joint_of;          ///< per MuJoCo joint: index into mechanism.joints
  std::vector<int> closure_of;        ///< per equality: index into mechanism.joints, or -1
  std::vector<bool> closed_by_sites;  ///< per equality: by two sites, which MuJoCo 2.2 cannot
};

/// Empty after errors, which are findings. Needs an EngineSession, whose warnings it reads.
[[nodiscard]] std::optional<ImportedMjcf> ImportMjcf(const std::string& text,
                                                     const std::string& file,
                                                     const std::vector<std::string>& warnings,
                                                     Diagnostics* diagnostics);

}  // namespace mbv::simulation
