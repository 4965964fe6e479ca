// summary.json of an archive against that of its repetition.
#pragma once

#include <string>

#include "report/rerun_report.h"

namespace mbv {

/// `exact`: both are made of the same traces by the same versions, so that every byte must be the
/// same; else verdict and exit code must be, and no check may move by more than kRerunShare of its
/// limit. Names the first value that differs.
[[nodiscard]] RerunFile CompareSummaries(const std::string& path, const std::string& packed,
                                         const std::string& rerun, bool exact);

}  // namespace mbv
