// Audit of the stabilizing platform's equations [Li 2018].
#pragma once

#include <string>

#include "audit/audit.h"

namespace mbv {

/// One row or more for each of (1)–(22), the 30 equations of a limb and the errata E1–E12, at 61
/// instants of the paper's example motion. Demands that the shipped model loads and runs.
[[nodiscard]] AuditTable AuditStabilizingPlatform(const std::string& models_dir);

}  // namespace mbv
