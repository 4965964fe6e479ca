// The tables of report.html. Each returns HTML, or "" when there is nothing to show.
#pragma once

#include <string>

#include "report/html_report.h"

namespace mbv {

[[nodiscard]] std::string FindingsHtml(const Report& report);
/// Every check with value, limit and margin (limit over value).
[[nodiscard]] std::string ChecksHtml(const Report& report);
[[nodiscard]] std::string DrivesHtml(const Report& report);
[[nodiscard]] std::string EngineHtml(const Report& report);
/// What drives and joints bear: force, power, stroke and speed; magnitudes of reactions.
[[nodiscard]] std::string LoadsHtml(const Report& report);
[[nodiscard]] std::string EnergyHtml(const Report& report);
[[nodiscard]] std::string NotComparedHtml(const Report& report);
[[nodiscard]] std::string AuditHtml(const std::optional<HtmlAudit>& audit);
[[nodiscard]] std::string SignalsHtml(const Report& report);
[[nodiscard]] std::string ParametersHtml(const Mechanism& mechanism);
[[nodiscard]] std::string ReproduceHtml(const HtmlInput& input);

}  // namespace mbv
