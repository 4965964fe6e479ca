// What is shipped, found in the source tree: whoever adds a model need not report the tests.
#pragma once

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/source_dir.h"

namespace mbv {

/// Names of all folders of models/ with a model.yaml, sorted.
[[nodiscard]] inline std::vector<std::string> ShippedModelNames() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    if (std::filesystem::exists(entry.path() / "model.yaml")) {
      names.push_back(entry.path().filename().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace mbv
