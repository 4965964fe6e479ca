// Percentiles of drive forces over time, from what points of a study recorded.
#pragma once

#include <filesystem>
#include <vector>

#include "pipeline/study_bench.h"
#include "report/study_report.h"

namespace mbv {

/// One band per drive, of the records in `file` (kForcesFile); none without records.
[[nodiscard]] std::vector<StudyBand> StudyBands(const StudyBench& bench,
                                                const std::filesystem::path& file);

}  // namespace mbv
