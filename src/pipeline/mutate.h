// Detection power: does a small error in one parameter, or a structural fault, turn the verdict?
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "report/mutation_report.h"

namespace mbv {

inline constexpr double kLargestBend = 0.1;     ///< undetected parameters are bent up to this
inline constexpr double kSmallestBend = 1e-15;  ///< smaller errors vanish in the parameter's digits

struct MutationOptions {
  double size = 1e-3;                   ///< relative error, > 0
  std::vector<std::string> parameters;  ///< empty: all of the model's own
  std::function<void(const std::string& parameter, double fraction)> progress;
  bool smallest = true;     ///< search for the smallest detectable error
  double resolution = 0.1;  ///< of the search, relative, > 0
  bool structural = true;   ///< structural faults, too (never when `parameters` are named)
};

/// Runs the scenario once as it is and many times with the simulated side bent, with MuJoCo's
/// inverse dynamics per sample (roundoff accuracy); the scenario's own limits judge. Bends make a
/// parameter larger, or smaller where the model refuses that; errors of a parameter that is zero
/// are relative to the largest one of its unit. The search is a bisection in log scale, started
/// where proportion puts it.
[[nodiscard]] MutationReport MutateScenario(const std::string& file,
                                            const MutationOptions& options);

}  // namespace mbv
