// The `witnesses:` section of a scenario: programs that compute it besides our own witnesses.
#pragma once

#include "input/value_reader.h"
#include "scenario/scenario.h"

namespace mbv {

/// In the order of the file. `folder`: of the scenario; words of a command that name a file in it
/// become its path.
[[nodiscard]] std::vector<ForeignWitness> ReadWitnesses(ValueReader* values, const YamlNode* node,
                                                        const std::string& folder);

}  // namespace mbv
