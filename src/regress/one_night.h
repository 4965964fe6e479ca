// Whether folders that are to be joined are the whole of one night.
#pragma once

#include <string>
#include <vector>

#include "regress/case_result.h"

namespace mbv {

/// One folder's run.
struct NightPart {
  std::string folder;
  RunInfo run;
  size_t cases = 0;
};

/// What speaks against it, one line each.
struct PartTroubles {
  std::vector<std::string> missing;  ///< "shard 3/8 missing", folders without a result
  std::vector<std::string> foreign;  ///< parts of different nights, labels or programs

  [[nodiscard]] bool empty() const { return missing.empty() && foreign.empty(); }
};

/// Shards of one night start within this time of each other: less than nights are apart.
inline constexpr double kNightSpan_h = 12.0;

/// A run that is no shard is whole by itself. `unfinished`: folders that hold no result.
[[nodiscard]] PartTroubles FindPartTroubles(const std::vector<NightPart>& parts,
                                            const std::vector<std::string>& unfinished);

}  // namespace mbv
