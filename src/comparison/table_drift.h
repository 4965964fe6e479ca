// A difference that grows with time.
#pragma once

#include <optional>
#include <string>

#include "core/types.h"

namespace mbv {

struct GrowingDifference {
  double left = kNan;  ///< RMS without it; the whole RMS where the growth follows no line
  std::string text;    ///< "the difference grows by 0.12 N/s, …"
};

/// Recognises a difference that is a line in time beside its start, and one whose size grows all
/// the way without being one.
/// \param time_s      sample times, increasing
/// \param difference  at these times, in `unit`
[[nodiscard]] std::optional<GrowingDifference> FindDrift(const VecX& time_s, const VecX& difference,
                                                         const std::string& unit);

}  // namespace mbv
