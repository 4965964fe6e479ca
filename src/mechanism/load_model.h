// model.yaml (and URDF) → Mechanism.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "mechanism/mechanism.h"

namespace mbv {

struct LoadOptions {
  /// Parameter overrides by name; an unknown name is an error.
  std::map<std::string, double> overrides;
  /// Where the overrides were written, for messages ("scenario.yaml:7:3").
  std::map<std::string, Finding> override_places;
};

struct LoadResult {
  std::optional<Mechanism> mechanism;  ///< empty when there are errors
  Diagnostics diagnostics;             ///< all findings, warnings included
};

/// Loads `file` (a model.yaml), evaluates its expressions, builds the joint graph and spanning
/// tree, solves the home pose and checks that all loops close. Never throws for bad input.
[[nodiscard]] LoadResult LoadModel(const std::string& file, const LoadOptions& options = {});

/// The same from text, for tests and fuzzing; `file` is used in messages and to find a URDF.
[[nodiscard]] LoadResult LoadModelText(const std::string& text, const std::string& file,
                                       const LoadOptions& options = {});

}  // namespace mbv
