// The rows of a study, computed in worker processes and appended to files as they come.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>

#include "pipeline/study_bench.h"

namespace mbv {

inline constexpr const char* kPointsFile = "points.csv";
/// Drive forces of points below kBandPoints: records of StudyForces::size() little-endian 32-bit
/// floats, in the order of the rows.
inline constexpr const char* kForcesFile = "forces.bin";
inline constexpr std::uint64_t kBandPoints = 4096;

/// Every `count`-th point, from `index` (0 … count − 1) on.
struct StudyShare {
  std::uint64_t index = 0, count = 1;

  [[nodiscard]] std::uint64_t size(std::uint64_t points) const {
    return points > index ? (points - index - 1) / count + 1 : 0;
  }
  [[nodiscard]] std::uint64_t number(std::uint64_t row) const { return index + row * count; }
  /// How many of its first `rows` have forces.
  [[nodiscard]] std::uint64_t records(std::uint64_t rows) const {
    return std::min(rows, size(kBandPoints));
  }
};

struct PointsOptions {
  StudyShare share;
  int jobs = 1;
  double timeout_s = 300.0;  ///< of one point
  std::function<void(std::uint64_t done, std::uint64_t all)> progress = {};
};

/// How much of an earlier computation is good.
struct PointsDone {
  std::uint64_t rows = 0, csv_bytes = 0, force_bytes = 0;
};
/// Looks at what a killed computation left in `folder`: rows of this study in their order, each
/// with its forces. A last line that was cut off does not count, nor does what comes after it.
[[nodiscard]] PointsDone FindDone(const StudyBench& bench, const StudyShare& share,
                                  const std::filesystem::path& folder);

/// Computes the rest, in order, and appends it; the files' bytes depend neither on the number of
/// jobs nor on interruptions. "" or what went wrong.
[[nodiscard]] std::string ComputePoints(const StudyBench& bench, const PointsOptions& options,
                                        const PointsDone& done,
                                        const std::filesystem::path& folder);

}  // namespace mbv
