// Words that a study's terminal text and page share. Internal to report/.
#pragma once

#include <string>

#include "report/study_report.h"

namespace mbv::internal {

/// "1024 points by sobol, 3 of them without a result".
[[nodiscard]] std::string PointsText(const StudyReport& report);
/// "limb1.drive.force.max < 1200".
[[nodiscard]] std::string LimitText(const StudyReport& report, const LimitResult& result);
/// "31 of 1024 points violate it (3.03 %; 95 % interval 2.07 … 4.27 %), 0 % may".
[[nodiscard]] std::string ShareText(const LimitResult& result);
/// "3 of 1024 points have no result (0.293 %), 5 % may"; of a study that says how many may.
[[nodiscard]] std::string MissingText(const StudyReport& report);
/// "witnesses disagree at 2 of 1024 points"; of a study with several witnesses.
[[nodiscard]] std::string DisagreedText(const StudyReport& report);
/// The key of the design in study files.
[[nodiscard]] const char* DesignWord(DesignKind kind);

}  // namespace mbv::internal
