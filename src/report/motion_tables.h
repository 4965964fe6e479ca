// What the report says about tables that command a motion: how they were read, and what smoothing
// did to positions, accelerations and drive forces.
#pragma once

#include <string>
#include <vector>

#include "base/json_text.h"
#include "report/report.h"

namespace mbv {

/// Lines for a terminal; empty without a table. Notes of the reader only when `verbose`.
[[nodiscard]] std::vector<std::string> MotionTableLines(const Report& report, bool verbose);

/// Section of report.html; "" without a table.
[[nodiscard]] std::string MotionTableHtml(const Report& report);

/// `motion_tables` of summary.json.
[[nodiscard]] nlohmann::ordered_json MotionTableJson(const Report& report);

}  // namespace mbv
