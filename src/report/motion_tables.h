// What the report says about tables that command a motion: how they were read, and what smoothing
// did to positions, accelerations and drive forces.
#pragma once

#include <string>
#include <vector>

#include "base/json_text.h"
#include "report/document.h"
#include "report/report.h"

namespace mbv {

/// Without blocks where no table moves anything. Notes of the reader only when `verbose`.
[[nodiscard]] ReportSection MotionTableSection(const Report& report, bool verbose);

/// `motion_tables` of summary.json.
[[nodiscard]] nlohmann::ordered_json MotionTableJson(const Report& report);

}  // namespace mbv
