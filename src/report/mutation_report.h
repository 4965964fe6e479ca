// What a mutation run found, and its writers.
#pragma once

#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/types.h"

namespace mbv {

/// One parameter bent on the simulated side only.
struct Mutation {
  std::string parameter, unit;
  double value = kNan;
  /// What relative errors are relative to: the value, or if that is zero the largest one of its
  /// unit (1 if there is none). Negative when the parameter was made smaller.
  double relative_to = kNan;
  bool ran = false;            ///< false: the bent model could not be simulated; `reason` says why
  bool detected = false;       ///< a check failed, or the bent model could not run at all
  bool by_force = false;       ///< a drive-force check failed
  double force_change = kNan;  ///< drive-force error caused, relative (the NRMSE of the check)
  /// The smallest relative error that was detected; one `resolution` smaller was not. NaN: not
  /// searched for, or nothing up to kLargestBend was detected.
  double smallest = kNan;
  std::string best_check;   ///< the check that fails at `smallest` (or sees it first); "model" when
                            ///< the bent model is refused
  double proved_to = kNan;  ///< undetected: the largest relative error tried
  double sensitivity = kNan;  ///< undetected: largest drive-force change at `proved_to`, relative
                              ///< to the RMS force
  std::string reason;         ///< why not detected, or why it did not run
};

/// One structural fault (structural_faults.h).
struct FaultResult {
  std::string kind, where;
  bool applicable = false;  ///< false: `reason` says why the mechanism cannot have it
  bool ran = false, detected = false;
  std::string check;                  ///< the failed check that is farthest beyond its limit
  double value = kNan, limit = kNan;  ///< of it
  size_t alike = 0;                   ///< equal places by symmetry of parts that were not run
  std::string reason;                 ///< not applicable, could not run, or why not detected
};

struct MutationReport {
  int exit_code = 4;  ///< 0 all detected or explained by no influence, 1 some missed, 2, 3 as run
  Diagnostics diagnostics;
  std::string scenario;
  double size = kNan, resolution = kNan;
  std::vector<Mutation> mutations;  ///< most sensitive first
  std::vector<FaultResult> faults;
  long runs = 0;  ///< simulations
  double wall_s = 0.0;
};

/// Tables, most sensitive first; Markdown when `markdown`.
[[nodiscard]] std::string ToText(const MutationReport& report, bool markdown);

/// The same for programs, schema "mbverify.mutate/1".
[[nodiscard]] std::string ToJson(const MutationReport& report);

}  // namespace mbv
