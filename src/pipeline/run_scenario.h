// One scenario through all stages: load → witnesses → comparison → files.
#pragma once

#include <string>

#include "pipeline/run_options.h"

namespace mbv {

/// Runs a scenario file of any kind. Bad input and numerical trouble are in the outcome; only our
/// own bugs throw (InternalError).
[[nodiscard]] RunOutcome RunScenario(const std::string& file, const RunOptions& options);

}  // namespace mbv
