// The sections of a stiffness scenario that do not need its mechanism.
#pragma once

#include "input/value_reader.h"
#include "scenario/stiffness_scenario.h"

namespace mbv {

[[nodiscard]] ReferenceSettings ReadStiffnessReference(ValueReader* values, const YamlNode* node);
[[nodiscard]] StiffnessSimulation ReadStiffnessSimulation(ValueReader* values,
                                                          const YamlNode* node);
/// The wrenches of `loads:` and where they come from.
[[nodiscard]] std::vector<Vec6> ReadStiffnessLoads(ValueReader* values, const YamlNode* node,
                                                   std::string* text);
[[nodiscard]] StiffnessLimits ReadStiffnessChecks(ValueReader* values, const YamlNode* node);

}  // namespace mbv
