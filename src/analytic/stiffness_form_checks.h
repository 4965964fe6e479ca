// What the stiffness forms of all mechanisms check before they are made, as findings.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "analytic/stiffness_form.h"

namespace mbv {

/// The coordinates by which a form takes its pose.
struct PoseNames {
  std::vector<std::string> needed, accepted;
  std::string hint;  ///< "the pose is platform.x, …"
};

/// Coordinates that the form of this mechanism cannot take, and those it misses.
void CheckPoseNames(const Mechanism& mechanism, const PoseNames& names, const PoseCoordinates& pose,
                    Diagnostics* diagnostics);

/// Parameters that the model does not have, and those of `positive` that are not.
void CheckStiffnessParameters(const Mechanism& mechanism, std::span<const std::string> positive,
                              std::span<const std::string> others, Diagnostics* diagnostics);

/// Index of `model` among `models`; 0 for "", the default; −1 after a finding.
[[nodiscard]] int IndexOfModel(std::span<const std::string> models, const std::string& model,
                               Diagnostics* diagnostics);

/// (M + Mᵀ)/2.
[[nodiscard]] inline Mat6 Symmetric(const Mat6& M) { return 0.5 * (M + M.transpose()); }

}  // namespace mbv
