// The audit of a page as JSON, so that the runs of a night compute it once.
#pragma once

#include <optional>
#include <string>

#include "report/html_report.h"

namespace mbv {

[[nodiscard]] std::string ToJson(const HtmlAudit& audit);
/// Empty when the text is not what ToJson() wrote.
[[nodiscard]] std::optional<HtmlAudit> AuditFromJson(const std::string& text);

}  // namespace mbv
