// `vary:` of a study file: numbers by name, each with its distribution. Internal to scenario/.
#pragma once

#include <string>
#include <vector>

#include "input/value_reader.h"
#include "mechanism/mechanism.h"
#include "study/study.h"

namespace mbv::internal {

/// What numbers are varied of.
struct VariedScenario {
  const Mechanism* mechanism = nullptr;
  const YamlNode* root = nullptr;  ///< the scenario's document
  std::string file;
};

/// `listed`: a list gives the points, so that no distribution is needed. Findings go to `values`.
[[nodiscard]] std::vector<Factor> ReadFactors(ValueReader* values, const YamlNode& node,
                                              const VariedScenario& varied, bool listed);

}  // namespace mbv::internal
