// Runs of a user's file on their way out of a child process.
#pragma once

#include <optional>
#include <string>

#include "simulation/own_file.h"

namespace mbv {

[[nodiscard]] std::string ToBytes(const OwnRun& run);
/// Empty where the bytes are no run.
[[nodiscard]] std::optional<OwnRun> OwnRunOf(const std::string& bytes);

}  // namespace mbv
