// Equation audit of the SCARA robot.
#pragma once

#include <string>

#include "audit/audit.h"

namespace mbv {

/// Rows for Eqs. (1)–(10), (22)–(49), the freedom count and Table 1 of [Zhu 2019].
[[nodiscard]] AuditTable AuditScaraRobot(const std::string& models_dir);

}  // namespace mbv
