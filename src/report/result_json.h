// summary.json: what results of every kind write alike.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "report/result.h"

namespace mbv {

/// The beginning of summary.json: schema, kind, names and files, verdict with reason, exit code and
/// attribution, checks, checks_off.
[[nodiscard]] nlohmann::ordered_json SummaryHead(const ResultView& view);
/// Its end: timing and versions.
void AddSummaryEnd(const ResultView& view, nlohmann::ordered_json* json);

/// [{what, why}]
[[nodiscard]] nlohmann::ordered_json NotComparedJson(const ResultView& view);
/// How many witnesses ran, pairs were compared, checks passed.
[[nodiscard]] nlohmann::ordered_json CountsJson(const ResultView& view);
[[nodiscard]] nlohmann::ordered_json FindingsJson(const Diagnostics& findings);

/// {name, ran, stop, message}
[[nodiscard]] nlohmann::ordered_json WitnessHead(const std::string& name,
                                                 const RunSummary& summary);
/// Where (and if it runs in time, when) a witness broke down and by how much, if it did.
void AddBreakdown(const ResultView& view, const RunSummary& summary, nlohmann::ordered_json* json);

}  // namespace mbv
