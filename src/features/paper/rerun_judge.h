// The result files of a packed scenario against those of its repetition.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "features/paper/package_manifest.h"
#include "features/paper/rerun_report.h"

namespace mbv {

/// Path in the archive → content.
using PackedResults = std::map<std::string, std::string>;

/// One outcome per file of either side, by path. Traces of motions, stiffnesses and points of
/// studies are judged by RerunLimits() of the scenario; summaries by their checks; what is made of
/// those must be the same where they are. `same_versions`: of the program and its libraries. The
/// scenario is loaded as packed, relative to the current folder.
[[nodiscard]] std::vector<RerunFile> JudgeReruns(const PackedScenario& scenario,
                                                 const PackedResults& packed,
                                                 const PackedResults& rerun, bool same_versions);

}  // namespace mbv
