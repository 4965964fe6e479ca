// A study's nominal forces against the table in the reference's place
// (features/study/validation.h).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "features/study/study_bench.h"
#include "features/study/validation.h"

namespace mbv {

/// The table on the scenario's grid of samples.
[[nodiscard]] AlignedTable TableOf(const Prepared& prepared);

/// Of the first witness, at the times of `forces`. u_num: as stated, else what the first witness
/// differs by from the second one (RMS), 0 if it is alone.
[[nodiscard]] MeasuredForces MeasureForces(const AlignedTable& table, const StudyRun& run,
                                           const StudyForces& forces,
                                           const StudyValidation& settings);

/// All of it, with the deviations of the records in `file` (kForcesFile). Where the first witness
/// has a step, u_num is half the grid convergence index of `mbverify converge`, unless stated.
[[nodiscard]] StudyValidationResult ValidateStudy(const StudyBench& bench,
                                                  const std::filesystem::path& file);

}  // namespace mbv
