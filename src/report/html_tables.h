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
[[nodiscard]] std::string EnergyHtml(const Report& report);
[[nodiscard]] std::string NotComparedHtml(const Report& report);
[[nodiscard]] std::string AuditHtml(const std::optional<HtmlAudit>& audit);
[[nodiscard]] std::string SignalsHtml(const Report& report);
[[nodiscard]] std::string ParametersHtml(const Mechanism& mechanism);
[[nodiscard]] std::string ReproduceHtml(const HtmlInput& input);

/// Work of a run by the trapezoidal rule over its samples [J].
struct Work {
  std::vector<double> drives;  ///< ∫ force · velocity dt per drive, model order
  std::vector<double> peak_w;  ///< largest |force · velocity| per drive [W]
  double input = kNan;         ///< ∫ power.input dt: drives, base and loads
  double energy = kNan;        ///< ∫ power.energy_rate dt: what the energy changed by
};
[[nodiscard]] Work WorkOf(const Trace& trace, const std::vector<std::string>& drives);

}  // namespace mbv
