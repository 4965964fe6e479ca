// `mbverify verify`: repeats the results of an archive (pipeline/package.h) on this machine.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "pipeline/progress.h"
#include "report/rerun_report.h"

namespace mbv {

struct VerifyOptions {
  using Programs = std::vector<std::string>;
  bool trust = false;  ///< run the programs that scenarios of the archive call
  /// Is asked before, of a scenario and its programs, without `trust`; null: no.
  std::function<bool(const std::string& scenario, const Programs& programs)> ask = {};
  /// Is shown the programs of a scenario that ran.
  std::function<void(const std::string& scenario, const Programs& programs)> show = {};
  ProgressFunction progress = {};
};

struct VerifyOutcome {
  int exit_code = 4;  ///< 0 repeated, 1 something differs, 2 bad input, 3 something could not run
  Diagnostics diagnostics;
  std::optional<RerunReport> report;  ///< empty after bad input
};

/// Nothing of the archive is believed: what is no plain ZIP of one folder with a manifest whose
/// checksums hold is a finding, and nothing of it is run.
[[nodiscard]] VerifyOutcome VerifyPackage(const std::string& file, const VerifyOptions& options);

}  // namespace mbv
