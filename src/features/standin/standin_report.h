// What mbverify standin found, for terminal, page and programs.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/json_text.h"
#include "features/standin/standin.h"
#include "report/document.h"

namespace mbv {

/// One sentence: how wrong a serial model is, and what helps most.
[[nodiscard]] std::string VerdictOf(const StandinResult& result);

/// Sentences to act on, the most important first.
[[nodiscard]] std::vector<std::string> AdviceOf(const StandinResult& result);

[[nodiscard]] std::string ToText(const StandinResult& result, const TextStyle& style);

/// Without `schema` and `program`.
[[nodiscard]] nlohmann::ordered_json ToJson(const StandinResult& result,
                                            const std::string& mechanism);

/// A row per pose, in the units of the headings.
[[nodiscard]] std::string StandinCsv(const StandinResult& result);

[[nodiscard]] std::string StandinPage(const StandinResult& result, const std::string& mechanism);

}  // namespace mbv
