// The cabin robot's stiffness in closed form, for the stiffness command.
#pragma once

#include "analytic/cabin_robot/stiffness.h"
#include "analytic/stiffness_form.h"

namespace mbv::cabin {

/// "corrected" (the default) and "as_printed": (61) for AB + EF and (54) for CD, both inverted; its
/// K is not symmetric and it has no shares.
[[nodiscard]] std::vector<std::string> StiffnessModels();

/// Pose: platform.x, platform.y, platform.yaw (γ), th3, th4, d5 (or the parameter d5 of the model);
/// d1 and th6 are accepted and do not matter. Shares: every beam; locked drives have none.
/// Indices: the diagonal of C.
[[nodiscard]] std::unique_ptr<StiffnessForm> MakeStiffnessForm(const Mechanism& mechanism,
                                                               const PoseCoordinates& pose,
                                                               const std::string& model,
                                                               Diagnostics* diagnostics);

/// The constants by their names in models/cabin_robot/elastic.yaml; they must exist.
[[nodiscard]] StiffnessParameters StiffnessParametersOf(const Mechanism& mechanism);

/// A pose for scenarios that give none; d5 stays the model's.
[[nodiscard]] PoseCoordinates ExampleStiffnessPose();
/// One map over the plane.
[[nodiscard]] std::vector<std::string> UsualStiffnessMaps();

}  // namespace mbv::cabin
