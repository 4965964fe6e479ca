// `mbverify study`: from a study file to its result folder.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "pipeline/study_points.h"
#include "report/study_report.h"
#include "scenario/study_file.h"

namespace mbv {

struct RunStudyOptions {
  std::string out_dir = "out";
  PointsOptions points;
  bool resume = false;   ///< go on with what a killed study left
  StudyOptions reading;  ///< of the file
};

struct StudyOutcome {
  int exit_code = 4;  ///< 0 limits are kept, 1 one is not, 2 bad input, 3 no point could be run
  Diagnostics diagnostics;
  std::string folder;                 ///< of the result; "" without one
  std::optional<StudyReport> report;  ///< of a whole study; shards have none
};

/// Rows grow in OUT/NAME.part, which goes when the result is in OUT/NAME. A shard's result is in
/// OUT/NAME.shard-2-of-5.
[[nodiscard]] StudyOutcome RunStudy(const std::string& file, const RunStudyOptions& options);

/// Joins the folders of all shards of one study: the same bytes as those of the study at once.
[[nodiscard]] StudyOutcome MergeStudies(const std::vector<std::string>& folders,
                                        const std::string& out_dir);

/// Findings of a study file, its scenario and model; a point is computed to check names.
[[nodiscard]] Diagnostics CheckStudy(const std::string& file);

}  // namespace mbv
