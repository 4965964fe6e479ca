// What failed, drifted or is missing, in words that all summaries share.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "regress/case_result.h"

namespace mbv {

/// "simulated_vs_analytic.force_nrmse is 3.5e-05, limit 1.0e-10, at limb2.drive.force, 7.16 s; was
/// 1.7e-13 in run 6": a failed check.
[[nodiscard]] std::string CheckText(const CaseResult& result,
                                    const std::pair<const std::string, MetricValue>& check);

/// What there is to say beside CaseResult::reason: the failed checks, worst first, at most `most`
/// of them, then when it was last as expected. Empty unless the scenario failed.
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

}  // namespace mbv
