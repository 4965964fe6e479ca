// How near a motion comes to singular poses: for a terminal, report.html and summary.json.
#pragma once

#include "base/json_text.h"
#include "report/document.h"
#include "report/report.h"

namespace mbv {

/// A row per kind. On a terminal only where one is close, or with `verbose`.
[[nodiscard]] ReportSection SingularitySection(const Report& report, bool verbose);
/// `singularity` of summary.json.
[[nodiscard]] nlohmann::ordered_json SingularityJson(const Report& report);
/// One sentence for each kind that comes close, of those that the motion asks for.
[[nodiscard]] std::vector<std::string> SingularityWarnings(const SingularApproaches& approaches);

}  // namespace mbv
