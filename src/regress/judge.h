// A worker's end, output and summary.json → CaseResult.
#pragma once

#include <optional>
#include <string>

#include "core/worker_pool.h"
#include "regress/case_result.h"
#include "regress/find_cases.h"

namespace mbv {

/// Judges against the file's `expect:`. `output` is all the worker printed; `summary` its
/// summary.json, empty if it left none.
[[nodiscard]] CaseResult JudgeCase(const CaseFile& file, const WorkerEnd& end, double timeout_s,
                                   const std::string& output,
                                   const std::optional<std::string>& summary);

/// Puts what a worker's inputs.json says into its result.
void AddInputs(const std::string& inputs, CaseResult* result);

}  // namespace mbv
