// `mbverify init`: a model and a scenario to begin with, in the user's folder.
#pragma once

#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "model_file/load_model.h"

namespace mbv {

/// A mechanism to start from; `@NAME@` in the texts stands for the user's name.
struct Starter {
  const char* name;
  const char* model;  ///< model.yaml
  const char* first;  ///< first.yaml
};
/// Compiled in from starters/; the first one is the default.
[[nodiscard]] const std::vector<Starter>& Starters();

struct InitOptions {
  std::string name;               ///< a letter, then letters, digits and '_'
  std::string from = "four_bar";  ///< of Starters(), or a robot's file (.urdf, .xml, .sdf)
  std::string into = ".";         ///< folder that gets models/NAME and scenarios/NAME
  LoadOptions load = {};          ///< of a robot
};

struct InitResult {
  Diagnostics diagnostics;         ///< why nothing was written
  std::vector<std::string> files;  ///< model file, scenario file; empty after a finding
  int exit_code = 2;               ///< after a finding: 2 bad input, 3 they cannot be written
};

/// Writes INTO/models/NAME/model.yaml and INTO/scenarios/NAME/first.yaml, both or neither; nothing
/// that is there is overwritten. All findings are given at once.
[[nodiscard]] InitResult InitModel(const InitOptions& options);

}  // namespace mbv
