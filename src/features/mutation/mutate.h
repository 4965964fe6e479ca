// Detection power: does a small error in one number of the model, or a structural fault, turn the
// verdict?
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "features/mutation/mutation_report.h"

namespace mbv {

inline constexpr double kLargestPerturbation = 0.1;  ///< unseen numbers are perturbed up to this
inline constexpr double kSmallestPerturbation =
    1e-15;  ///< smaller errors vanish in the number's digits

/// Modes of the simulation in which a forward scenario is perturbed.
enum class MutationModes { kBoth, kOwn, kInverse };

struct MutationOptions {
  double size = 1e-3;                ///< relative error, > 0
  std::vector<std::string> numbers;  ///< by name; empty: all
  std::function<void(const std::string& number, double fraction)> progress;
  bool smallest = true;     ///< search for the smallest detectable error
  double resolution = 0.1;  ///< of the search, relative, > 0
  bool structural = true;   ///< structural faults, too (never when `numbers` are named)
  MutationModes modes = MutationModes::kBoth;
  /// A worker's share: numbers and faults `part`, `part + parts`, … (MergeParts).
  size_t part = 0, parts = 1;
};

/// Runs the scenario once as it is and many times with the simulated side perturbed: in its own
/// mode and by its own limits, and, where that integrates forward, with MuJoCo's inverse dynamics
/// per sample (round-off accuracy) by the limits for that. Each number is made larger and smaller;
/// both errors must be seen. Errors of a number that is zero are relative to the largest one of its
/// unit. The search is a bisection in log scale, started where proportion puts it.
[[nodiscard]] MutationReport MutateScenario(const std::string& file,
                                            const MutationOptions& options);

}  // namespace mbv
