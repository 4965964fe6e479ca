// The tables of a motion's page. Each returns HTML, or "" when there is nothing to show.
#pragma once

#include <string>

#include "report/html_report.h"

namespace mbv {

[[nodiscard]] std::string DrivesHtml(const Report& report);
[[nodiscard]] std::string EngineHtml(const Report& report);
/// What drives and joints bear: force, power, stroke and speed; magnitudes of reactions.
[[nodiscard]] std::string LoadsHtml(const Report& report);
[[nodiscard]] std::string EnergyHtml(const Report& report);
[[nodiscard]] std::string AuditHtml(const std::optional<HtmlAudit>& audit);
[[nodiscard]] std::string SignalsHtml(const Report& report);

/// How long each witness took: text, not HTML.
[[nodiscard]] std::string TimesText(const Report& report);

}  // namespace mbv
