// What failed, drifted or is missing, in words that all summaries share.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "features/regress/case_result.h"
#include "features/regress/database.h"

namespace mbv {

/// The name of a check in the words of the report: "drive force, RMS (simulated vs analytic)".
/// Names of no metric, as studies have them, stay.
[[nodiscard]] std::string QuantityText(const std::string& check);

/// "drive force, RMS (simulated vs analytic) is 3.5e-05, limit 1.0e-10, at limb2.drive.force,
/// 7.16 s; was 1.7e-13 in run 6": a failed check.
[[nodiscard]] std::string CheckText(const CaseResult& result,
                                    const std::pair<const std::string, MetricValue>& check);

/// What there is to say beside CaseResult::reason: the failed checks, worst first, at most `most`
/// of them, then when it was last as expected and what changed since. Empty unless the scenario
/// failed.
[[nodiscard]] std::vector<std::string> FailureTexts(const CaseResult& result, size_t most);

/// The reason with the worst check, in one line.
[[nodiscard]] std::string FailureLine(const CaseResult& result);

/// All drifts of a scenario in one line, the worst metric first; "" without any.
[[nodiscard]] std::string DriftLine(const CaseResult& result);

/// "was in run 6 of …, and was not found now".
[[nodiscard]] std::string MissingText(const MissingCase& missing);

/// Cases by severity: what ended badly, what is not as expected (by how much), what drifted (by how
/// much), the rest; by name where equal.
[[nodiscard]] std::vector<const CaseResult*> BySeverity(const RegressReport& report);

// What workers wrote into their logs, as plain text.

/// The last `count` lines of a text, without control characters.
[[nodiscard]] std::string LastLines(const std::string& text, int count);

/// Escape sequences of terminals go, too.
[[nodiscard]] std::string WithoutControls(const std::string& text);

// Scenarios that an earlier run had and a later one should have had.

/// What a run of `paths` covers: the beginning that the names of a folder's scenarios share. Single
/// files cover nothing, they are there or bad input.
[[nodiscard]] std::vector<std::string> CoversOf(const std::vector<std::string>& paths);

/// RunInfo::covers as kept in the history; "" of a shard and of a partial run: what they do not
/// have, others may have.
[[nodiscard]] std::string CoversText(const RunInfo& run);

/// Sorted by key. A scenario is missing until it is back, or accepted in a run without it.
[[nodiscard]] std::vector<MissingCase> FindMissing(Database* database, long run);

/// Whether a metric changed by more than roundoff: by 1 %, where one of both is above 1e-13.
[[nodiscard]] bool IsOther(double before, double now);

/// What changed between two results beside their numbers: limits, input files ("turn.yaml
/// changed"). Of histories that did not keep which files were read, that some file changed.
[[nodiscard]] Changes ChangesOfResult(Database* database, long before, long now);

/// The same of two runs: program, libraries, machine.
[[nodiscard]] Changes ChangesOfRun(Database* database, long before, long now);

/// "run 6 of 2026-01-30T02:00:00Z, abc123, mbverify 0.1.0 build 0123abcd"; "" if there is none.
[[nodiscard]] std::string DescribeRun(Database* database, long run);

}  // namespace mbv
