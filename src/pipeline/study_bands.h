// Percentiles of drive forces over time, from what points of a study recorded.
#pragma once

#include <filesystem>
#include <vector>

#include "pipeline/study_bench.h"
#include "report/study_report.h"

namespace mbv {

/// One drive's forces in the records of `file` (kForcesFile): points × times, those points whose
/// forces are all numbers. `left_out`: how many are not.
[[nodiscard]] std::vector<std::vector<float>> DriveRecords(const StudyForces& forces, size_t drive,
                                                           const std::filesystem::path& file,
                                                           size_t* left_out = nullptr);

/// One band per drive, of the records in `file` (kForcesFile); none without records.
[[nodiscard]] std::vector<StudyBand> StudyBands(const StudyBench& bench,
                                                const std::filesystem::path& file);

}  // namespace mbv
