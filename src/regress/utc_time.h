// Times of runs: "2026-01-31T02:00:00Z".
#pragma once

#include <string>

namespace mbv {

[[nodiscard]] std::string UtcNow();

/// Hours since 1970; NaN if it is no such time.
[[nodiscard]] double UtcHours(const std::string& utc);

}  // namespace mbv
