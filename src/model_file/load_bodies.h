// The bodies of a model file alone: how they are joined, and whether their masses are possible, is
// not judged.
#pragma once

#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"

namespace mbv {

struct LoadedBodies {
  std::vector<Body> bodies;  ///< the world first; empty after errors
  Diagnostics diagnostics;   ///< all findings, warnings included
};

/// Reads `file` (model.yaml or .urdf) as LoadModel() does. Never throws for bad input.
[[nodiscard]] LoadedBodies LoadBodies(const std::string& file);

/// The same from text; `file` is used in messages and to find other files.
[[nodiscard]] LoadedBodies LoadBodiesText(const std::string& text, const std::string& file);

}  // namespace mbv
