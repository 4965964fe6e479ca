// Detection power: does a small error in one parameter turn the verdict?
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/types.h"

namespace mbv {

/// One parameter bent on the simulated side only.
struct Mutation {
  std::string parameter, unit;
  double value = kNan;
  bool ran = false;            ///< false: the bent model could not be simulated; `reason` says why
  bool detected = false;       ///< a check failed, or the bent model could not run at all
  bool by_force = false;       ///< a drive-force check failed
  double force_change = kNan;  ///< drive-force error caused, relative (the NRMSE of the check)
  double smallest = kNan;      ///< relative error at which the first check would reach its limit,
                               ///< by proportion from this run
  std::string best_check;      ///< the check that sees it first
  std::string reason;          ///< why not detected, or why it did not run
};

struct MutationReport {
  int exit_code = 4;  ///< 0 all detected or explained by no influence, 1 some missed, 2, 3 as run
  Diagnostics diagnostics;
  std::string scenario;
  double size = kNan;
  std::vector<Mutation> mutations;
};

struct MutationOptions {
  double size = 1e-3;                   ///< relative error, > 0
  std::vector<std::string> parameters;  ///< empty: the model's own that are not zero
  std::function<void(const std::string& parameter, double fraction)> progress;
};

/// Runs the scenario once as it is and once per parameter, with MuJoCo's inverse dynamics per
/// sample (roundoff accuracy) and the reference switched off; the scenario's own limits judge.
[[nodiscard]] MutationReport MutateScenario(const std::string& file,
                                            const MutationOptions& options);

/// A table, most sensitive first; Markdown when `markdown`.
[[nodiscard]] std::string ToText(const MutationReport& report, bool markdown);

}  // namespace mbv
