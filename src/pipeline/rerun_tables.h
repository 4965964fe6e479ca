// Tables of numbers among results, an archive's against those of its repetition. Internal to
// rerun_judge.cc.
#pragma once

#include <string>
#include <vector>

#include "pipeline/rerun_judge.h"

namespace mbv {

/// The files of a kind of scenario that are judged number by number; all else follows from them.
[[nodiscard]] const std::vector<const char*>& NumberFiles(const std::string& kind);

/// Signals of one of those; a sentence in `why` where the tables have other columns, rows or words.
[[nodiscard]] std::vector<RerunSignal> CompareTables(const PackedScenario& scenario,
                                                     const std::string& name,
                                                     const PackedResults& packed,
                                                     const PackedResults& rerun, std::string* why);

}  // namespace mbv
