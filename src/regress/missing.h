// Scenarios that an earlier run had and a later one should have had.
#pragma once

#include <string>
#include <vector>

#include "regress/case_result.h"
#include "regress/database.h"

namespace mbv {

/// What a run of `paths` covers: the beginning that the names of a folder's scenarios share. Single
/// files cover nothing, they are there or bad input.
[[nodiscard]] std::vector<std::string> CoversOf(const std::vector<std::string>& paths);

/// RunInfo::covers as kept in the history; "" of a shard and of a partial run: what they do not
/// have, others may have.
[[nodiscard]] std::string CoversText(const RunInfo& run);

/// Sorted by key. A scenario is missing until it is back, or accepted in a run without it.
[[nodiscard]] std::vector<MissingCase> FindMissing(Database* database, long run);

/// "run 6 of 2026-01-30T02:00:00Z, abc123, mbverify 0.1.0 build 0123abcd"; "" if there is none.
[[nodiscard]] std::string DescribeRun(Database* database, long run);

}  // namespace mbv
