// `mbverify package`: the archive beside a paper, with inputs, results, figures and what describes
// them (docs/how-to/archives.md).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "pipeline/program_consent.h"
#include "pipeline/progress.h"
#include "report/package_files.h"

namespace mbv {

struct PackageOptions {
  std::string folder = "paper";  ///< the one folder in the archive
  std::string date;              ///< YYYY-MM-DD; "": that of SOURCE_DATE_EPOCH, else 1980-01-01
  bool page = true, figures = true;
  ProgramConsent programs = {};  ///< that scenarios name
  ProgressFunction progress = {};
};

struct PackageOutcome {
  int exit_code = 4;  ///< 0: there is an archive, whatever its scenarios came to; 2 bad input
  Diagnostics diagnostics;
  PackageDescription description;
  std::string zip;  ///< its bytes; "" without
};

/// Copies inputs to a folder of its own and runs the scenarios there, as whoever unpacks the
/// archive will. The same inputs give the same bytes.
[[nodiscard]] PackageOutcome MakePackage(const std::vector<std::string>& scenarios,
                                         const PackageOptions& options);

/// Whether a date is one of the calendar, written YYYY-MM-DD.
[[nodiscard]] bool IsDate(const std::string& text);

}  // namespace mbv
