// What a night and a merge have in common: which files they own, and how they end.
#pragma once

#include <string>
#include <vector>

#include "regress/find_cases.h"
#include "regress/regress.h"
#include "regress/run_folder.h"

namespace mbv {

/// Adds a line to the outcome's trouble; nothing for "".
void AddTrouble(const std::string& text, RegressOutcome* outcome);

/// Names of the files that FinishNight() writes into --out, and the logs of `keys`.
[[nodiscard]] std::vector<std::string> NightFiles(const RegressOptions& options,
                                                  const std::vector<std::string>& keys);

/// Outputs that are inputs, too, as far as loading tells: "" or which.
[[nodiscard]] std::string FindClash(const RegressOptions& options,
                                    const std::vector<CaseFile>& cases);

/// Keys whose results would lie where a file of the night belongs (a folder of scenarios named
/// "index.html"): "" or which.
[[nodiscard]] std::string FindTaken(const RegressOptions& options,
                                    const std::vector<std::string>& keys);

/// Everything after the scenarios ran: history, summaries, files, exit code.
void FinishNight(const RegressOptions& options, const RunFolder& folder, RegressOutcome* outcome);

}  // namespace mbv
