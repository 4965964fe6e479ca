// What the ground bears of feet: for a terminal, report.html and summary.json.
#pragma once

#include "base/json_text.h"
#include "report/document.h"
#include "report/report.h"

namespace mbv {

/// A row per foot, by the witness that a reader looks at first; the path of the centre of pressure
/// under each foot. Without blocks where nothing stands on the ground.
[[nodiscard]] ReportSection ContactSection(const Report& report);
/// `contacts` of summary.json: of every witness.
[[nodiscard]] nlohmann::ordered_json ContactsJson(const Report& report);

}  // namespace mbv
