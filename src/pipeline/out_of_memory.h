// What is told when a run does not fit into memory.
#pragma once

#include <string>

#include "pipeline/run_scenario.h"

namespace mbv {

/// Exit code 3 with a finding that names what takes the memory: the samples and signals of a
/// motion. Call it when everything of the run is released.
[[nodiscard]] RunOutcome OutOfMemory(const std::string& file, const ScenarioOptions& options);

}  // namespace mbv
