// The audit of the equations of a file: each numbered equation against the reference at random
// states, and the usual slips of those that are wrong.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "base/diagnostics.h"
#include "features/equation_audit/audit.h"

namespace mbv {

struct FileAuditOptions {
  bool search = true;      ///< for slips
  int samples = 0;         ///< states; 0: as many as the file says
  std::string model = {};  ///< in the place of the file's own; "": that one
  std::function<void(const std::string& equation, double fraction)> progress = {};
};

/// Empty after a finding that leaves nothing to say. A print that cannot be evaluated is a row;
/// functions that are missing, names and quantities that are unknown, are errors.
[[nodiscard]] std::optional<AuditTable> AuditFile(const std::string& file,
                                                  const FileAuditOptions& options,
                                                  Diagnostics* diagnostics);

}  // namespace mbv
